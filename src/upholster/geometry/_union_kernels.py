"""Union-find: which numbered items are connected. A parent is never higher than its children."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.types import IntArray, int64

__all__ = ["join_pairs", "root_of", "unite"]


@inline
def root_of(parent: IntArray, item: int) -> Any:
    """Return the lowest item that is connected to an item."""
    at = int64(item)
    while parent[at] != at:
        parent[at] = parent[parent[at]]
        at = int64(parent[at])
    return at


@inline
def unite(parent: IntArray, one: int, other: int) -> None:
    """Connect two items."""
    a, b = root_of(parent, one), root_of(parent, other)
    parent[max(a, b)] = min(a, b)


@kernel
def join_pairs(pairs: NDArray[np.int64], parent: IntArray) -> None:
    """Connect the items of pairs (P, 2); `parent` (n,), first 0, 1, …, becomes each set's lowest item."""
    for n in range(len(pairs)):
        unite(parent, pairs[n, 0], pairs[n, 1])
    for item in range(len(parent)):
        parent[item] = parent[parent[item]]
