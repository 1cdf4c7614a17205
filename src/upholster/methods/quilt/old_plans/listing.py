"""A plain list of placements: any quilt, also one made by hand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.chart import Chart

__all__ = ["PlacementList"]


@dataclass(frozen=True, eq=False, slots=True)
class PlacementList:
    """Placements as they are painted.

    Attributes
    ----------
    placed
        Structured array of `PLACEMENT`: chart after chart, in painting order on each.
    mask_cells
        uint8: the cells of the cut masks' windows, 1 = new, row by row, one mask after another.
    """

    placed: NDArray[np.void]
    mask_cells: NDArray[np.uint8]

    def placements(
        self,
        charts: Sequence[Chart],  # noqa: ARG002  # as every plan
    ) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return both as they are."""
        return self.placed, self.mask_cells
