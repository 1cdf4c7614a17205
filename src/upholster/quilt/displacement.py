"""Where places of a chart read in the exemplar, relative to a placement's source: ½·(C + M(q))·(q − c).

C is the placement's centre matrix: the warp field's at its centre c plus the placement's own offset (SPEC.md,
section 8). The integers are those of every decoder, by one formula
(`upholster.quilt._field_kernels.reading`).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.types import IntArray
from upholster.quilt._field_kernels import reading
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.warp_field import UNIT, WarpField

__all__ = ["centre_matrices", "levels_of", "warped_sources"]


def centre_matrices(field: WarpField, placements: NDArray[np.void]) -> IntArray:
    """Return placements' centre matrices, (n, 4) int32 in 1/4096 pixel per step, row by row."""
    found: IntArray = field.between(placements["row"], placements["column"]) + placements["offset"]
    return found


def levels_of(centres: NDArray[np.integer], most: int, *, ratio: float = 1.0) -> NDArray[np.int64]:
    """Return the pyramid level from which placements are painted, by their centre matrices (n, 4).

    It is the number of thresholds 2·2^q (q = 0, 1, …) that the matrix's determinant reaches, in square pixels
    per texel, but at most `most`. So texels are 1 to 1.4 times as wide as the details of their level, and
    neighbouring placements look equally sharp. `ratio` is the number of texels painted per square step.
    """
    m = centres.astype(np.int64)
    determinant = (m[:, 0] * m[:, 3] - m[:, 1] * m[:, 2]).astype(np.float64)
    thresholds = 2.0 * UNIT**2 * 2.0 ** np.arange(most) * ratio
    return np.searchsorted(thresholds, determinant, side="right").astype(np.int64)


def warped_sources(
    field: WarpField, owner: NDArray[np.void], rows: ArrayLike, columns: ArrayLike
) -> tuple[IntArray, IntArray]:
    """Return where places read in the exemplar, in 1/16 pixel, each through its own placement.

    Parameters
    ----------
    field
        The chart's warp field.
    owner
        (n,) of `PLACEMENT`: the placement that shows at each place.
    rows, columns
        (n,) integers: the places, in 1/16 step from the chart's first edge.

    Returns
    -------
    tuple of ndarray
        Rows and columns in the exemplar, int32, before they are mirrored into it.
    """
    row, column = np.asarray(rows, np.int64), np.asarray(columns, np.int64)
    y, x = reading.py_func(  # type: ignore[attr-defined]  # compiled: its Python function
        centre_matrices(field, owner).T.astype(np.int64),
        field.between(row, column).T.astype(np.int64),
        np.clip(row - owner["row"], -16383, 16383),
        np.clip(column - owner["column"], -16383, 16383),
    )
    symmetry = SYMMETRIES[owner["symmetry"]]
    return (
        (owner["source_row"] + symmetry[:, 0] * y + symmetry[:, 1] * x).astype(np.int32),
        (owner["source_column"] + symmetry[:, 2] * y + symmetry[:, 3] * x).astype(np.int32),
    )
