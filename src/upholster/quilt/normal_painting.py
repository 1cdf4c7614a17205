"""Painting normal maps: their vectors turn with the texture.

A normal map has vectors (x to the right, y upward, z outward) in the exemplar. On the surface the texture is
rotated against the texels' own frame, so painting rotates the vectors back: by the placement's symmetry, and
by the angle of the warp field at the texel.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.parallel import run_tasks
from upholster.quilt._normal_kernels import lengthen_vectors, turn_vectors
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import check_painted, image_pyramid, paint_each, texel_places
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.pyramid import Pyramid
from upholster.types import PixelArray, Progress

__all__ = ["lengthen", "paint_normals", "turn_window", "turned_pyramid", "unit_normal_texels"]

_SLACK = 1 / 128
"""Lengths this close to 1 are left: rounding to 8 bits changes them by up to 0.0068."""


def paint_normals(
    quilt: Quilt,
    normals: PixelArray,
    *,
    density: float | None = None,
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
    density, threads, progress
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
    if normals.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"normal map is of {normals.dtype}; allowed: uint8, uint16, float32")
    pyramid, which = turned_pyramid(quilt, normals)
    texels = paint_each(quilt, pyramid, which, density=density, threads=threads, progress=progress)
    tasks: list[Callable[[], object]] = [
        partial(turn_window, quilt, n, chart, (slice(0, chart.height), slice(0, chart.width)), array)
        for n, (chart, array) in enumerate(zip(texels.charts, texels.arrays, strict=True))
    ]
    run_tasks(tasks, threads=threads)
    return replace(texels, exemplar=normals)


def turned_pyramid(quilt: Quilt, normals: PixelArray) -> tuple[Pyramid, NDArray[np.int64]]:
    """Return a normal map's pyramid, an image for each symmetry, and which of them each placement reads."""
    symmetries = np.unique(quilt.placements["symmetry"])
    pyramid = image_pyramid([_turned(normals, symmetry) for symmetry in symmetries])
    return pyramid, np.searchsorted(symmetries, quilt.placements["symmetry"]).astype(np.int64)


def turn_window(
    quilt: Quilt, index: int, painted: Chart, window: tuple[slice, slice], out: PixelArray
) -> None:
    """Turn painted normals of a window, see `upholster.quilt.painting.ChartPainter`, in place."""
    chart, field = quilt.charts[index], quilt.fields[index]
    if field.is_identity:
        return
    rows = texel_places(chart.height, painted.height)[window[0]]
    columns = texel_places(chart.width, painted.width)[window[1]]
    turn_vectors(out, field.matrices, field.margin, rows, columns, _top(out.dtype))


def unit_normal_texels(texels: Texels, *, threads: int | None = None) -> Texels:
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
    tasks: list[Callable[[], object]] = [partial(lengthen, array) for array in arrays]
    run_tasks(tasks, threads=threads)
    return Texels(texels.charts, arrays)


def lengthen(normals: PixelArray) -> None:
    """Give painted normals (height, width, 3) length 1, in place, see `unit_normal_texels`."""
    lengthen_vectors(normals, float(_top(normals.dtype)), _SLACK)


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
