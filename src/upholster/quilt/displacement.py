"""Where texels of a block lie in the exemplar, seen from its source: ½·(C + M(q))·(q − c).

C is the block's centre matrix: its own, or the warp field's at its centre c (SPEC.md, "Painting"). Integers
are those that every decoder computes, by one formula (`upholster.quilt._field_kernels.displacement`).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.quilt._field_kernels import displacement as integer_displacement
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import UNIT, WarpField
from upholster.types import IntArray

__all__ = ["centre_matrices", "levels_of", "warped_sources"]


def centre_matrices(field: WarpField, placements: NDArray[np.void]) -> IntArray:
    """Return placements' centre matrices, (n, 4) int32 in 1/4096 pixel per texel, row by row."""
    found = field.integers_at(placements["row"], placements["column"])
    own = placements["centred"] > 0
    return np.where(own[:, None], placements["matrix"], found) if own.any() else found


def levels_of(centres: IntArray, most: int) -> NDArray[np.int64]:
    """Return the level of the pyramid that placements are painted from, by their centre matrices (n, 4).

    Level 0 is the exemplar itself. It is the level whose pixels come nearest to texels in size: the number of
    thresholds 2·4^m (m = 0, 1, …) that the matrix's determinant reaches, in square pixels per square texel;
    at most `most`.
    """
    m = centres.astype(np.int64)
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
    y, x = integer_displacement.py_func(  # type: ignore[attr-defined]  # compiled: its Python function
        centre_matrices(field, owner).T,
        field.integers_at(row, column).T,
        row - owner["row"],
        column - owner["column"],
    )
    symmetry = SYMMETRIES[owner["symmetry"]]
    return (
        (owner["source_row"] + symmetry[:, 0] * y + symmetry[:, 1] * x).astype(np.int32),
        (owner["source_column"] + symmetry[:, 2] * y + symmetry[:, 3] * x).astype(np.int32),
    )
