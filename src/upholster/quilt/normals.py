"""Painting normal maps: their vectors turn with the texture.

A normal map has vectors (x to the right, y upward, z outward) in the exemplar. On the surface the texture is
rotated against the texels' own frame, so painting rotates the vectors back: by the placement's symmetry, and
by the angle of the warp field at the texel.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from upholster.errors import InputError
from upholster.parallel import run_tasks
from upholster.quilt._normal_kernels import lengthen_vectors, turn_vectors
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import CANVAS_DTYPES, check_painted, fill_bare, paint_each
from upholster.quilt.placement import SYMMETRIES
from upholster.types import PixelArray, Progress

__all__ = ["paint_normals", "unit_normals"]

_SLACK = 1 / 128
"""Lengths this close to 1 are left: rounding to 8 bits changes them by up to 0.0068."""


def paint_normals(
    quilt: Quilt,
    normals: PixelArray,
    *,
    rows: tuple[int, int] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Texels:
    """Paint a quilt with a normal map, in the frame that texels have on the surface.

    That frame is: T along texel columns, S_t made a unit vector; N the surface's normal; B = N × T, which
    points up in the texture. It is glTF's with a TANGENT of (T, 1), see `upholster.model.vertex_tangents`.

    Parameters
    ----------
    quilt
        Where each block comes from.
    normals
        (H, W, 3) uint8, uint16 or float32: (x, y, z) to the right, upward and outward in the exemplar, coded
        as (v + 1)/2 times the largest integer (1 for floats).
    rows
        As of `upholster.quilt.painting.paint_each`.
    threads, progress
        As in `upholster.quilt.paint`.

    Returns
    -------
    Texels
        (height, width, 3) per chart, coded alike, of the same dtype.

    Raises
    ------
    InputError
        For another shape or dtype.

    Notes
    -----
    The exemplar's axes on the surface are e1 (to the right) and e2 (down), and M takes texel steps to
    (e2, e1), scaled: so its second column is T in those axes, at angle φ. A vector (x, y) then has the
    components (x·cos φ − y·sin φ, x·sin φ + y·cos φ) along T and B, whatever the shear.
    """
    normals = check_painted(quilt, normals)
    if normals.ndim != 3 or normals.shape != (*quilt.exemplar_shape, 3):
        height, width = quilt.exemplar_shape
        raise InputError(f"normal map has shape {normals.shape}; the quilt wants ({height}, {width}, 3)")
    if normals.dtype not in CANVAS_DTYPES:
        raise InputError(f"normal map is of {normals.dtype}; allowed: uint8, uint16, float32")
    symmetries = np.unique(quilt.placements["symmetry"])
    images = [_turned(normals, symmetry) for symmetry in symmetries] or [normals]
    which = np.searchsorted(symmetries, quilt.placements["symmetry"]).astype(np.int64)
    texels = paint_each(quilt, images, which, rows=rows, threads=threads, progress=progress)
    top = _top(normals.dtype)
    tasks: list[Callable[[], object]] = [
        partial(turn_vectors, array, field.matrices, field.margin, float(top))
        for array, field in zip(texels.arrays, quilt.fields, strict=True)
        if not field.is_identity
    ]
    run_tasks(tasks, threads=threads)
    fill_bare(quilt, normals, texels)
    return replace(texels, exemplar=normals)


def unit_normals(texels: Texels, *, threads: int | None = None) -> Texels:
    """Give painted normals length 1 again, which they lose where blocks are blended.

    Painting itself, as every decoder of a stream does it, stops before that: graphics cards do the same to
    each normal that they look up.

    Parameters
    ----------
    texels
        As `paint_normals` returns them.
    threads
        As in `upholster.quilt.paint`.

    Returns
    -------
    Texels
        Others; vectors of length 1, but for rounding, stay as they are to the bit.
    """
    arrays = tuple(array.copy() for array in texels.arrays)
    tasks: list[Callable[[], object]] = [
        partial(lengthen_vectors, array, float(_top(array.dtype)), _SLACK) for array in arrays
    ]
    run_tasks(tasks, threads=threads)
    return Texels(texels.charts, arrays)


def _turned(normals: PixelArray, symmetry: int) -> PixelArray:
    """Return the normal map of the relief h(T·p) for that of the relief h(p), at the same pixels.

    Its gradient in (row, column) is Tᵀ times that of h; x is minus the slope along columns, y the one along
    rows, for y points upward.
    """
    a, b, c, d = SYMMETRIES[symmetry]
    top = _top(normals.dtype)

    def signed(channel: int, sign: int) -> PixelArray:
        samples = normals[:, :, channel]
        return samples if sign > 0 else top - samples

    x = signed(0, d) if d else signed(1, -b)
    y = signed(1, a) if a else signed(0, -c)
    return np.stack([x, y, normals[:, :, 2]], axis=2).astype(normals.dtype)


def _top(dtype: np.dtype[np.generic]) -> int:
    return 1 if dtype == np.float32 else 255 if dtype == np.uint8 else 65535
