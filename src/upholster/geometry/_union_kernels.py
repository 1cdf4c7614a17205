"""Union-find: which numbered items are connected. A parent is never higher than its children."""

from typing import Any

from upholster.base.types import IntArray, int64
from upholster.runtime.jit import inline

__all__ = ["root_of", "unite"]


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
