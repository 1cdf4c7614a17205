"""What the plans' modules share: kinds, limits, and what each plan's decoder can do."""

from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.placement import MASK_CUT, MASK_NONE, check_placements, touches
from upholster.quilt.warp_field import WarpField

__all__ = [
    "BATCH",
    "FINE_LIST",
    "GRID",
    "LIST",
    "MAX_CELLS",
    "MAX_PLACEMENTS",
    "STRIPS",
    "PlanDecoder",
    "check_decoded",
    "grown",
]

Array = TypeVar("Array", bound=NDArray[Any])

MAX_PLACEMENTS = 2**19
MAX_CELLS = 2**25
"""Cells over the windows of all masks."""

LIST, STRIPS, GRID, FINE_LIST = 0, 1, 2, 3
"""Kinds of plan; a fine list has sources in 1/16 pixel and may have centre matrices."""

BATCH = 4096
"""Symbols coded in one call."""


class PlanDecoder(Protocol):
    """Decodes a plan's sources and masks as their bytes arrive.

    Attributes
    ----------
    known, total
        How many blocks are known, and how many there are.
    known_cells, total_cells
        The same of the cells of masks.
    """

    known: int
    total: int
    known_cells: int
    total_cells: int

    @property
    def complete(self) -> bool:
        """Whether every block and every cell is known."""
        ...

    @property
    def unread(self) -> int:
        """Bytes that came and that no symbol needed."""
        ...

    def feed_sources(self, data: bytes) -> None:
        """Take further bytes of the sources; raises FormatError for a block that can not be painted."""
        ...

    def feed_masks(self, data: bytes) -> None:
        """Take further bytes of the masks; all sources must be known."""
        ...

    def charts_known(self) -> int:
        """Return how many charts have all their own blocks known: they arrive one after another."""
        ...

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known; other charts repeat the exemplar."""
        ...


def check_decoded(
    placed: NDArray[np.void],
    charts: tuple[Chart, ...],
    fields: tuple[WarpField, ...],
    exemplar_shape: tuple[int, int],
) -> None:
    """Check placements whose masks have not arrived.

    Raises
    ------
    FormatError
        If one does not touch its chart, or can not be painted.
    """
    outside = ~touches(placed, charts)
    if outside.any():
        place = int(np.argmax(outside))
        raise FormatError(f"block {place} of chart {placed['chart'][place]} does not touch it")
    whole = placed.copy()
    whole["mask"][whole["mask"] == MASK_CUT] = MASK_NONE
    try:
        check_placements(whole, np.zeros(0, np.uint8), charts, fields, exemplar_shape)
    except InputError as error:
        raise FormatError(str(error)) from None


def grown(array: Array, length: int) -> Array:
    """Return an array of at least so many rows, further ones 0."""
    if length <= len(array):
        return array
    grown = np.zeros((max(length, len(array) + len(array) // 2), *array.shape[1:]), array.dtype)
    grown[: len(array)] = array
    return cast(Array, grown)
