"""What a chart's warp field says about its placements and texels: matrices, pyramid levels, exact sources.

The same integers as the kernels that paint use (CONVENTIONS.md, "Painting"), over whole arrays.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.quilt._paint_kernels import SYMMETRIES
from upholster.quilt.warp_field import FIELD_STEP, UNIT, WarpField
from upholster.types import IntArray

__all__ = ["LARGEST_WARPED", "levels_of", "matrices_at", "warped_sources"]

LARGEST_WARPED = 2048
"""Largest side in texels of a block on a chart with a field: keeps all of its arithmetic within 32 bits."""


def matrices_at(field: WarpField, rows: ArrayLike, columns: ArrayLike) -> IntArray:
    """Return M at texels, in 1/4096 pixel per texel: bilinear between the nodes round each, rounded once.

    Parameters
    ----------
    field
        A chart's warp field.
    rows, columns
        Integers that broadcast together; beyond the field's nodes the nearest of its border holds.

    Returns
    -------
    ndarray
        (..., 4) int32: row per row, row per column, column per row, column per column.
    """
    nodes = field.matrices
    i, down = _nodes(rows, field.margin, nodes.shape[0])
    j, right = _nodes(columns, field.margin, nodes.shape[1])
    below, beside = np.minimum(i + 1, nodes.shape[0] - 1), np.minimum(j + 1, nodes.shape[1] - 1)
    down, right = down[..., None], right[..., None]
    left, up = FIELD_STEP - right, FIELD_STEP - down
    total: IntArray = (nodes[i, j] * left + nodes[i, beside] * right) * up
    total = total + (nodes[below, j] * left + nodes[below, beside] * right) * down
    matrices: IntArray = (total + 512) >> 10
    return matrices


def _nodes(texels: ArrayLike, margin: int, count: int) -> tuple[IntArray, IntArray]:
    at = np.asarray(texels, np.int32)
    node = margin + at // FIELD_STEP
    inside = (node >= 0) & (node < count - 1)
    return np.clip(node, 0, count - 1), np.where(inside, at % FIELD_STEP, 0).astype(np.int32)


def levels_of(field: WarpField, placements: NDArray[np.void], most: int) -> NDArray[np.int64]:
    """Return the level of the pyramid that each placement is painted from: 0 is the exemplar itself.

    It is the one whose pixels come nearest to texels in size: the number of thresholds 2·4^m (m = 0, 1, …)
    that det M at the placement's centre reaches, in square pixels per square texel; at most `most`.
    """
    m = matrices_at(field, placements["row"], placements["column"]).astype(np.int64)
    determinant = m[:, 0] * m[:, 3] - m[:, 1] * m[:, 2]
    thresholds = 2 * UNIT**2 * 4 ** np.arange(most, dtype=np.int64)
    return np.searchsorted(thresholds, determinant, side="right").astype(np.int64)


def warped_sources(
    field: WarpField, owner: NDArray[np.void], rows: ArrayLike, columns: ArrayLike
) -> tuple[IntArray, IntArray]:
    """Return where texels lie in the exemplar, in 1/16 pixel, each through its own placement.

    Parameters
    ----------
    field
        The chart's warp field.
    owner
        (n,) of `PLACEMENT`: the one that each texel is painted by.
    rows, columns
        (n,) integers: the texels.

    Returns
    -------
    tuple of ndarray
        Rows and columns in the exemplar, int32, before they are clamped to it.
    """
    row, column = np.asarray(rows, np.int32), np.asarray(columns, np.int32)
    a = matrices_at(field, owner["row"], owner["column"]) + matrices_at(field, row, column)
    y, x = row - owner["row"], column - owner["column"]
    v = (a[:, 0] * y + a[:, 1] * x + 256) >> 9
    w = (a[:, 2] * y + a[:, 3] * x + 256) >> 9
    symmetry = SYMMETRIES.astype(np.int32)[owner["symmetry"]]
    return (
        owner["source_row"] + symmetry[:, 0] * v + symmetry[:, 1] * w,
        owner["source_column"] + symmetry[:, 2] * v + symmetry[:, 3] * w,
    )
