"""Plans: how a quilt's placements are arranged, as synthesis knows it and as the stream writes it.

`listing` is a plain list of placements, made by hand or cut short; `strips` is method "paper"'s plan (blocks
on every chart, strips of edge blocks along shared edges); `grid` is method "quilt"'s (transferred blocks,
then blocks on an even grid); `source_map` is method "pixel"'s (a source for each texel).
Placements derive from a plan; nothing finds a plan out of placements.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart
from upholster.methods.quilt.old_plans.grid import ChartGrid, GridPlan
from upholster.methods.quilt.old_plans.listing import PlacementList
from upholster.methods.quilt.old_plans.source_map import SourceMap
from upholster.methods.quilt.old_plans.strips import Strip, StripLayout, StripPlan

__all__ = ["ChartGrid", "GridPlan", "PlacementList", "Plan", "SourceMap", "Strip", "StripLayout", "StripPlan"]


class Plan(Protocol):
    """What every plan can do."""

    def placements(self, charts: Sequence[Chart]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return the placements, chart after chart in painting order, and the cells of their masks."""
        ...
