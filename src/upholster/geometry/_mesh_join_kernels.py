"""Union-find over items of a mesh."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.types import IntArray

__all__ = ["join"]


@inline
def _root(parent: IntArray, n: int) -> int:
    while parent[n] != n:
        parent[n] = parent[parent[n]]
        n = parent[n]
    return n


@kernel
def join(pairs: NDArray[np.int64], parent: IntArray) -> None:
    """Join the items of each pair (n, 2) into one set; `parent` becomes the lowest item of each set."""
    for n in range(parent.shape[0]):
        parent[n] = n
    for n in range(pairs.shape[0]):
        a, b = _root(parent, pairs[n, 0]), _root(parent, pairs[n, 1])
        if a < b:
            parent[b] = a
        else:
            parent[a] = b
    for n in range(parent.shape[0]):
        parent[n] = _root(parent, n)
