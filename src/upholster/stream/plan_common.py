"""What the plans' modules share: kinds, limits, and what each plan's decoder can do."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.methods.quilt.masked import MASK_CUT, MASK_NONE, ChartSizes, check_placements, touches
from upholster.methods.quilt.old_plans import PlacementList
from upholster.quilt.warp_field import WarpField

__all__ = [
    "BATCH",
    "FINE_LIST",
    "GRID",
    "LIST",
    "MAX_CELLS",
    "MAX_PLACEMENTS",
    "STRIPS",
    "PlanCode",
    "PlanDecoder",
    "check_decoded",
    "grown",
    "known_part",
]

Array = TypeVar("Array", bound=NDArray[Any])

MAX_PLACEMENTS = 2**19
MAX_CELLS = 2**25
"""Cells over the windows of all masks."""

LIST, STRIPS, GRID, FINE_LIST = 0, 1, 2, 3
"""Kinds of plan; a fine list has sources in 1/16 pixel and may have centre matrices."""

BATCH = 4096
"""Symbols coded in one call."""


@dataclass(frozen=True, slots=True)
class PlanCode:
    """A plan as bytes.

    Attributes
    ----------
    plan, sources, masks
        What `upholster.stream.plans.open_plan` and its decoder take; `masks` is empty where there are none.
    order
        The charts in the order in which they are coded.
    source_ends, mask_ends
        Per entry of `order`, how many bytes of `sources` and `masks` tell the charts up to it, about.
    """

    plan: bytes
    sources: bytes
    masks: bytes
    order: tuple[int, ...]
    source_ends: tuple[int, ...]
    mask_ends: tuple[int, ...]

    @property
    def parts(self) -> tuple[bytes, bytes, bytes]:
        """Plan, sources and masks."""
        return self.plan, self.sources, self.masks

    @classmethod
    def of(
        cls,
        plan: bytes,
        sources: bytes,
        masks: bytes,
        order: Sequence[int],
        source_ends: Sequence[int],
        mask_ends: Sequence[int],
    ) -> "PlanCode":
        """Return a plan's code; a chart that comes several times in `order` ends where it ends last."""
        last = {chart: n for n, chart in enumerate(order)}
        charts = tuple(dict.fromkeys(order))
        ends = [
            (*(min(given[last[chart]], len(coded)) for chart in charts[:-1]), len(coded))
            for given, coded in ((source_ends, sources), (mask_ends, masks))
        ]
        return cls(plan, sources, masks, charts, *ends)


class PlanDecoder(Protocol):
    """Decodes a plan's sources and masks as their bytes arrive.

    Attributes
    ----------
    order
        The charts in the order in which they are coded.
    known, total
        How many blocks are known, and how many there are.
    known_cells, total_cells
        The same of the cells of masks.
    """

    order: list[int]
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

    def go_on(self) -> None:
        """Read on: further warp fields are known. Raises as `feed_sources` does."""
        ...

    def feed_masks(self, data: bytes) -> None:
        """Take further bytes of the masks; all sources must be known."""
        ...

    def charts_known(self) -> int:
        """Return how many charts have all their own blocks known: they arrive one after another."""
        ...

    def quilt(self) -> Quilt:
        """Return the quilt as far as it is known; other charts have no placements."""
        ...


def check_decoded(
    placed: NDArray[np.void],
    charts: ChartSizes,
    fields: Sequence[WarpField | None],
    exemplar_shape: tuple[int, int],
) -> None:
    """Check placements whose masks have not arrived, on charts whose warp fields have.

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


def known_part(
    charts: tuple[Chart, ...],
    exemplar_shape: tuple[int, int],
    placed: NDArray[np.void],
    mask_cells: NDArray[np.uint8],
    known: Collection[int],
    fields: Sequence[WarpField | None],
) -> Quilt:
    """Return a quilt of the placements of `known` charts, whose warp fields are known."""
    done = set(known)
    identity = WarpField.identity()
    own = (field if n in done and field is not None else identity for n, field in enumerate(fields))
    plan = PlacementList(placed[np.argsort(placed["chart"], kind="stable")], mask_cells)
    return Quilt(charts, exemplar_shape, plan, tuple(own))


def grown(array: Array, length: int) -> Array:
    """Return an array of at least so many rows, further ones 0."""
    if length <= len(array):
        return array
    grown = np.zeros((max(length, len(array) + len(array) // 2), *array.shape[1:]), array.dtype)
    grown[: len(array)] = array
    return cast(Array, grown)
