"""Connected components of numbered items."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.geometry._union_kernels import join_pairs
from upholster.types import IntArray

__all__ = ["connected"]


def connected(count: int, pairs: NDArray[np.integer[Any]]) -> IntArray:
    """Return for each of `count` items the lowest item connected to it by pairs (P, 2): (count,) int32."""
    lowest = np.arange(count, dtype=np.int32)
    join_pairs(np.ascontiguousarray(pairs, np.int64), lowest)
    return lowest
