"""The loop over texels that NumPy cannot write as whole arrays."""

import numpy as np

from upholster.jit import kernel
from upholster.types import IntArray

__all__ = ["largest_square"]


@kernel
def largest_square(labels: IntArray, sides: IntArray) -> int:
    """Return the side of the largest square of one label ≥ 0 in `labels` (H, W).

    `sides` (W,) is scratch. The side of the largest square that ends at a texel is one more than the least of
    those that end left of it, above it, and left above it, where all four have its label.
    """
    best = 0
    for row in range(labels.shape[0]):
        diagonal = 0
        for column in range(labels.shape[1]):
            above = sides[column] if row > 0 else 0
            label = labels[row, column]
            side = 0
            if label >= 0:
                side = 1
                if (
                    row > 0
                    and column > 0
                    and labels[row - 1, column] == label
                    and labels[row, column - 1] == label
                    and labels[row - 1, column - 1] == label
                ):
                    side += min(above, min(diagonal, sides[column - 1]))
            sides[column] = np.int32(side)
            diagonal = above
            best = max(best, side)
    return best
