"""Connected components."""

import numpy as np
from numpy.typing import NDArray

from upholster.types import IntArray

__all__ = ["components"]


def components(pairs: IntArray | NDArray[np.int64], count: int) -> IntArray:
    """Return the lowest item of each item's connected component, (count,) int32.

    Parameters
    ----------
    pairs
        (P, 2) connected items.
    count
        Number of items.
    """
    lowest = np.arange(count, dtype=np.int32)
    one, other = np.ascontiguousarray(pairs.T, np.int32)
    # Each round joins every item that has a lower neighbour; what is left are pairs of joined items.
    while len(one):
        np.minimum.at(lowest, np.maximum(one, other), np.minimum(one, other))
        while not np.array_equal(further := lowest[lowest], lowest):
            lowest = further
        one, other = lowest[one], lowest[other]
        apart = one != other
        one, other = one[apart], other[apart]
    return lowest
