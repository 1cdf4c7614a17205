"""Ranks of blocks: which of them can be laid in parallel."""

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import kernel

__all__ = ["rank_in_order"]


@kernel
def rank_in_order(
    firsts: NDArray[np.int64],
    others: NDArray[np.int64],
    order: NDArray[np.int64],
    ranks: NDArray[np.int64],
) -> None:
    """Write the ranks of the blocks that `order` lists; all ranks are −1 before.

    `firsts` and `others` are as in `Near`. Blocks that are not listed keep −1.
    """
    for n in order:
        highest = np.int64(-1)
        for k in range(firsts[n], firsts[n + 1]):
            highest = max(highest, ranks[others[k]])
        ranks[n] = highest + 1
