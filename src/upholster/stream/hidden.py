"""Cells of masks that no texel shows: an encoder may tell them as it likes.

Where refinement has laid further blocks over a chart, a third of the masks' cells is hidden. Told as their
contexts predict they cost next to nothing, and a prefix with some of a chart's masks is not worse than
one with none.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.quilt import Quilt
from upholster.methods.quilt._masked_kernels import weight_rows
from upholster.methods.quilt.masked import MASK_CUT, mask_sizes
from upholster.methods.quilt.old_plans import GridPlan
from upholster.stream._hidden_kernels import find_hidden

__all__ = ["hidden_cells"]


def hidden_cells(quilt: Quilt) -> NDArray[np.bool_] | None:
    """Return which cells of a plan's masks change no texel, whatever they are, all of them at once.

    Only charts of several grids are looked at: those that refinement has laid blocks on. Elsewhere masks
    tell much of the masks that are linked to them, and hidden cells are worth what they cost.

    Parameters
    ----------
    quilt
        Of any plan.

    Returns
    -------
    ndarray or None
        One for each of the plan's cells; None where no chart has several grids.
    """
    plan = quilt.plan
    if not isinstance(plan, GridPlan):
        return None
    several = np.flatnonzero(np.bincount([grid.chart for grid in plan.grids]) > 1)
    if not len(several):
        return None
    placed = plan.in_order()
    sizes = np.where(placed["mask"] == MASK_CUT, mask_sizes(placed, quilt.charts), 0)
    placed["first_cell"] = np.where(sizes > 0, np.cumsum(sizes) - sizes, -1)
    starts = dict[int, int]()
    for place, grid in enumerate(plan.grids):
        starts.setdefault(grid.chart, int(plan.starts[place]))
    counts = np.bincount(placed["chart"], minlength=len(quilt.charts))
    hidden = np.zeros(len(plan.mask_cells), np.uint8)
    height, width = quilt.largest_block
    scratch = np.empty((2, weight_rows(height, height), width), np.int32)
    for n in several.tolist():
        chart, start = quilt.charts[n], starts[n]
        opaque = np.zeros((chart.height, chart.width), np.uint8)
        mine = placed[start : start + counts[n]]
        find_hidden(mine, plan.mask_cells, scratch, opaque, hidden)
    found: NDArray[np.bool_] = hidden == 1
    return found
