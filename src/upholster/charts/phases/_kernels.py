"""Hot loops of `upholster.charts.phases`."""

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.types import IntArray

__all__ = ["first_members"]

ComplexArray = NDArray[np.complex128]


@inline
def _top(part: IntArray, at: int) -> int:
    # The first member of the part that `at` belongs to; the way there is made shorter.
    while part[at] != at:
        part[at] = part[part[at]]
        at = part[at]
    return at


@kernel
def first_members(first: IntArray, second: IntArray, part: IntArray) -> None:
    """Put in `part` (n,) for each of n numbers the least of those that links (first, second) join it to."""
    for i in range(len(part)):
        part[i] = i
    for e in range(len(first)):
        a, b = _top(part, first[e]), _top(part, second[e])
        part[max(a, b)] = min(a, b)
    for i in range(len(part)):
        part[i] = _top(part, i)
