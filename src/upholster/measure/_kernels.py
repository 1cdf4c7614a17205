"""The loop over texels that NumPy cannot express with whole arrays."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import kernel
from upholster.types import IntArray

__all__ = ["largest_copied_square"]


@kernel
def largest_copied_square(
    painted: NDArray[np.bool_], below: NDArray[np.bool_], right: NDArray[np.bool_], sides: IntArray
) -> int:
    """Return the side of the largest square of `painted` texels (H, W) whose neighbours are all linked.

    `below` (H - 1, W) and `right` (H, W - 1) say which texels are linked to their lower and right neighbours;
    `sides` (W,) is scratch. The largest square that ends at a texel has a side one longer than the smallest
    of those that end left of it, above it, and left above it, if the four are linked all round.
    """
    best = 0
    for row in range(painted.shape[0]):
        diagonal = 0
        for column in range(painted.shape[1]):
            above = sides[column] if row > 0 else 0
            side = 0
            if painted[row, column]:
                side = 1
                if (
                    row > 0
                    and column > 0
                    and below[row - 1, column]
                    and right[row, column - 1]
                    and right[row - 1, column - 1]
                    and below[row - 1, column - 1]
                ):
                    side += min(above, min(diagonal, sides[column - 1]))
            sides[column] = np.int32(side)
            diagonal = above
            best = max(best, side)
    return best
