"""Painting normal maps: their vectors rotate with the texture.

A normal map has vectors (x to the right, y upward, z outward) in the exemplar. On the surface the texture is
rotated relative to the texels' own frame. So painting rotates the vectors back: by the placement's symmetry,
and by the angle of the warp field at the texel.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.quilt._normal_kernels import lengthen_vectors, turn_vectors
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import check_painted, image_pyramid, paint_each, texel_places
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.pyramid import Pyramid
from upholster.runtime.parallel import run_tasks

__all__ = ["lengthen", "paint_normals", "turn_window", "turned_pyramid", "unit_normal_texels"]

_SLACK = 1 / 128
"""Lengths this close to 1 are kept: rounding to 8 bits changes them by up to 0.0068."""


def paint_normals(
    quilt: Quilt,
    normals: PixelArray,
    *,
    density: float | None = None,
) -> Texels:
    """Paint a quilt with a normal map, in the frame of texels on the surface.

    In that frame, T is along texel columns, S_t made a unit vector; N is the surface's normal; and B = N × T
    points up in the texture. It is glTF's with a TANGENT of (T, 1), see
    `upholster.model.tangents.vertex_tangents`.

    Parameters
    ----------
    quilt
        The origin of each block.
    normals
        (H, W, 3) uint8, uint16 or float32: (x, y, z) to the right, upward and outward in the exemplar, coded
        as (v + 1)/2 times the largest integer (1 for floats).
    density
        As in `upholster.quilt.painting.paint`.

    Returns
    -------
    Texels
        (height, width, 3) per chart, coded alike, with the same dtype.

    Raises
    ------
    InputError
        For another shape or dtype.

    Notes
    -----
    The exemplar's axes on the surface are e1 (to the right) and e2 (down). M maps texel steps to (e2, e1),
    scaled, so its second column is T in those axes, at angle φ. A vector (x, y) then has the components
    (x·cos φ − y·sin φ, x·sin φ + y·cos φ) along T and B, whatever the shear.
    """
    normals = check_painted(quilt, normals)
    if normals.ndim != 3 or normals.shape != (*quilt.exemplar_shape, 3):
        height, width = quilt.exemplar_shape
        raise InputError(f"normal map has shape {normals.shape}; the quilt wants ({height}, {width}, 3)")
    if normals.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"normal map is of {normals.dtype}; allowed: uint8, uint16, float32")
    pyramid, which = turned_pyramid(quilt, normals, density)
    texels = paint_each(quilt, pyramid, which, density=density)
    tasks: list[Callable[[], object]] = [
        partial(turn_window, quilt, n, chart, (slice(0, chart.height), slice(0, chart.width)), array)
        for n, (chart, array) in enumerate(zip(texels.charts, texels.arrays, strict=True))
    ]
    run_tasks(tasks)
    return replace(texels, exemplar=normals)


def turned_pyramid(
    quilt: Quilt, normals: PixelArray, density: float | None = None
) -> tuple[Pyramid, NDArray[np.int64]]:
    """Return a normal map's pyramid, with one image per symmetry, and the image that each placement reads."""
    symmetries = np.unique(quilt.placements["symmetry"])
    turned = [_turned(normals, symmetry) for symmetry in symmetries]
    pyramid = image_pyramid(turned, quilt, density)
    return pyramid, np.searchsorted(symmetries, quilt.placements["symmetry"]).astype(np.int64)


def turn_window(
    quilt: Quilt, index: int, painted: Chart, window: tuple[slice, slice], out: PixelArray
) -> None:
    """Rotate painted normals of a window, see `upholster.quilt.painting.ChartPainter`, in place."""
    chart, field = quilt.charts[index], quilt.fields[index]
    if field.is_identity:
        return
    rows = texel_places(chart.height, painted.height)[window[0]]
    columns = texel_places(chart.width, painted.width)[window[1]]
    turn_vectors(out, field.matrices, field.margin, rows, columns, _top(out.dtype))


def unit_normal_texels(texels: Texels) -> Texels:
    """Restore length 1 of painted normals, which they lose where blocks are blended.

    Painting itself stops before that, as in every decoder of a stream: graphics cards normalize each normal
    that they look up.

    Parameters
    ----------
    texels
        The result of `paint_normals`.

    Returns
    -------
    Texels
        New texels; vectors that have length 1 up to rounding are unchanged to the bit.
    """
    arrays = tuple(array.copy() for array in texels.arrays)
    tasks: list[Callable[[], object]] = [partial(lengthen, array) for array in arrays]
    run_tasks(tasks)
    return Texels(texels.charts, arrays)


def lengthen(normals: PixelArray) -> None:
    """Scale painted normals (height, width, 3) to length 1, in place: see `unit_normal_texels`."""
    lengthen_vectors(normals, float(_top(normals.dtype)), _SLACK)


def _turned(normals: PixelArray, symmetry: int) -> PixelArray:
    """Convert the normal map of the relief h(p) to that of the relief h(T·p), at the same pixels.

    Its gradient in (row, column) is Tᵀ times that of h. x is minus the slope along columns, y is the slope
    along rows, because y points upward.
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
