"""What a chart shows before its placements have arrived: the exemplar at its scale, repeated and mirrored."""

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MASK_NONE, PLACEMENT
from upholster.quilt.plans import PlacementList
from upholster.quilt.warp_field import OCTAVE, UNIT, WarpField

__all__ = ["MAX_TILES", "assemble", "check_tiles", "mirrored_tiling", "scale_field", "scale_of"]

MAX_TILES = 2**19
"""Repeats of the exemplar over all charts."""

_LARGEST_TILE, _LARGEST_SCALED = 4096, 2048

# Symmetries that mirror nothing, columns, rows, both.
_SYMMETRIES = np.array([[0, 5], [7, 2]], np.uint8)


def scale_field(scale: int) -> WarpField:
    """Return the warp field of so many 1/32 octaves, the same everywhere."""
    if not scale:
        return WarpField.identity()
    return WarpField(np.array([[[scale, scale, 0, 0]]], np.int16), 0)


def mirrored_tiling(
    index: int, chart: Chart, exemplar_shape: tuple[int, int], scale: int = 0
) -> NDArray[np.void]:
    """Return placements of the whole exemplar, mirrored at its borders, over chart `index`.

    Parameters
    ----------
    index, chart
        The chart and its number.
    exemplar_shape
        (height, width) in pixels, at most 4096 each.
    scale
        Exemplar pixels per texel, in 1/32 octave: the chart's warp field is `scale_field` of it.

    Returns
    -------
    ndarray
        Of `PLACEMENT`, in raster order from the chart's top left corner.
    """
    unit = _unit(scale)
    height, width = (_tile(side, unit) for side in exemplar_shape)
    rows, columns = -(-chart.height // height), -(-chart.width // width)
    placed = np.zeros((rows, columns), PLACEMENT)
    placed["chart"], placed["first_cell"], placed["mask"] = index, -1, MASK_NONE
    placed["height"], placed["width"] = height, width
    i, j = np.arange(rows)[:, None], np.arange(columns)
    placed["row"], placed["column"] = i * height + height // 2, j * width + width // 2
    placed["symmetry"] = _SYMMETRIES[i % 2, j % 2]
    # A mirrored block's centre is the mirrored texel; texel n lies n + ½ texels below the exemplar's edge.
    for name, n, extent, side in (
        ("source_row", i, height, exemplar_shape[0]),
        ("source_column", j, width, exemplar_shape[1]),
    ):
        texel = np.where(n % 2, extent - 1 - extent // 2, extent // 2)
        placed[name] = np.clip(((2 * texel + 1) * unit >> 9) - 8, 0, 16 * side - 1)
    return placed.reshape(-1)


def assemble(
    charts: tuple[Chart, ...],
    exemplar_shape: tuple[int, int],
    placed: NDArray[np.void],
    mask_cells: NDArray[np.uint8],
    known: Collection[int],
    fields: tuple[WarpField, ...] = (),
    scale: int = 0,
) -> Quilt:
    """Return a quilt of the placements of `known` charts; all others repeat the exemplar at `scale`."""
    done = set(known)
    rest = [n for n in range(len(charts)) if n not in done]
    repeated = [mirrored_tiling(n, charts[n], exemplar_shape, scale) for n in rest]
    placed = np.concatenate([placed, *repeated])
    if rest:
        given = fields or (WarpField.identity(),) * len(charts)
        fields = tuple(given[n] if n in done else scale_field(scale) for n in range(len(charts)))
    plan = PlacementList(placed[np.argsort(placed["chart"], kind="stable")], mask_cells)
    return Quilt(charts, exemplar_shape, plan, fields)


def check_tiles(charts: Sequence[Chart], exemplar_shape: tuple[int, int], scale: int = 0) -> None:
    """Check that the charts take at most `MAX_TILES` repeats of an exemplar of at most 4096 each way.

    Raises
    ------
    InputError
        If it does not.
    """
    if not all(1 <= side <= 4096 for side in exemplar_shape):
        raise InputError(
            f"exemplar is {exemplar_shape[1]}×{exemplar_shape[0]}; allowed: 1 to 4096 each way in a stream"
        )
    count = _tiles(charts, exemplar_shape, scale)
    if count > MAX_TILES:
        raise InputError(f"charts take {count} repeats of the exemplar; allowed: {MAX_TILES} in a stream")
    if not _fits(exemplar_shape, scale):
        raise InputError(
            f"scale is {scale}; allowed: repeats of the exemplar of {_LARGEST_SCALED} texels or less"
        )


def scale_of(fields: Sequence[WarpField], charts: Sequence[Chart], exemplar_shape: tuple[int, int]) -> int:
    """Return the scale for a first view of charts with these warp fields: the middle one that fits."""
    sizes = [field.nodes[..., :2].reshape(-1) for field in fields]
    scale = int(np.clip(np.rint(np.median(np.concatenate(sizes))), -OCTAVE * 4, OCTAVE * 4 - 1))
    while scale > 0 and not (
        _tiles(charts, exemplar_shape, scale) <= MAX_TILES and _fits(exemplar_shape, scale)
    ):
        scale -= 1
    while scale < 0 and not _fits(exemplar_shape, scale):
        scale += 1
    return scale


def _fits(exemplar_shape: tuple[int, int], scale: int) -> bool:
    largest = max(_tile(side, _unit(scale)) for side in exemplar_shape)
    return largest <= (_LARGEST_SCALED if scale else _LARGEST_TILE)


def _unit(scale: int) -> int:
    return int(scale_field(scale).matrices[0, 0, 0])


def _tile(side: int, unit: int) -> int:
    """Return how many texels so many pixels take, at `unit`/4096 pixels a texel."""
    return max(1, (side * UNIT + unit // 2) // unit)


def _tiles(charts: Sequence[Chart], exemplar_shape: tuple[int, int], scale: int) -> int:
    height, width = (_tile(side, _unit(scale)) for side in exemplar_shape)
    return sum(math.prod((-(-chart.height // height), -(-chart.width // width))) for chart in charts)
