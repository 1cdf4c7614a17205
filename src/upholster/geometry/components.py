"""Connected components of numbered items."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray

__all__ = ["connected"]


def connected(count: int, pairs: NDArray[np.integer[Any]]) -> IntArray:
    """Return for each of `count` items the lowest item connected to it by pairs (P, 2): (count,) int32."""
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
