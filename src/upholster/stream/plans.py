"""Plans to bytes and back: the plan, the sources, the masks, each a chunk of its own.

Each kind of plan has a module: `list_plan`, `strip_plan`, `grid_plan`. Whatever the plan, a decoder takes
bytes as they come and knows at once which placements they determine.
"""

from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.limits import Limits
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.methods.quilt.masked import touches
from upholster.methods.quilt.old_plans import GridPlan, PlacementList, SourceMap, StripPlan
from upholster.quilt.warp_field import WarpField
from upholster.stream.budget import PaintBudget, strips_work
from upholster.stream.byte_reader import ByteReader
from upholster.stream.grid_plan import GridDecoder, encode_grid
from upholster.stream.list_plan import ListDecoder, encode_list
from upholster.stream.plan_common import (
    FINE_LIST,
    GRID,
    MAX_CELLS,
    MAX_PLACEMENTS,
    STRIPS,
    PlanCode,
    PlanDecoder,
)
from upholster.stream.strip_plan import StripDecoder, encode_strips

__all__ = ["encode_plan", "open_plan", "refuse_source_map"]


def encode_plan(quilt: Quilt, hidden: NDArray[np.bool_] | None = None) -> PlanCode:
    """Encode a quilt's plan.

    Parameters
    ----------
    quilt
        What to encode; cells 0 or 1. Its warp fields are told elsewhere, see `upholster.stream.warp_fields`.
    hidden
        Which cells no texel shows: of a plan of grids they are told as costs least.

    Raises
    ------
    InputError
        For more placements or cells than the format holds, cells other than 0 and 1, a placement that does
        not touch its chart, or a plan that the format has no place for, such as a source map.
    """
    if isinstance(quilt.plan, SourceMap):
        refuse_source_map(quilt.texel_count, quilt.exemplar_shape)
    placed, cells = quilt.placements, quilt.mask_cells
    if len(placed) > MAX_PLACEMENTS:
        raise InputError(f"quilt has {len(placed)} placements; allowed: {MAX_PLACEMENTS} in a stream")
    if len(cells) > MAX_CELLS:
        raise InputError(f"quilt has {len(cells)} cells of masks; allowed: {MAX_CELLS} in a stream")
    if len(cells) and cells.max() > 1:
        raise InputError(f"a cell of the quilt is {cells.max()}; allowed: 0 and 1")
    outside = ~touches(placed, quilt.charts)
    if outside.any():
        raise InputError(f"placement {int(outside.argmax())} does not touch its chart")
    budget = PaintBudget(quilt.charts, Limits())
    try:
        if isinstance(quilt.plan, StripPlan):
            budget.take(strips_work(quilt.plan.layout))
        else:
            budget.spend(placed)
        budget.check_cells(len(cells))
    except FormatError as error:
        raise InputError(f"{error} in a stream") from None
    match quilt.plan:
        case StripPlan() as plan:
            return encode_strips(plan)
        case GridPlan() as plan:
            return encode_grid(quilt, plan, hidden)
        case PlacementList():
            return encode_list(quilt)
        case other:
            raise InputError(f"plan is a {type(other).__name__}; allowed: StripPlan, GridPlan, PlacementList")


def refuse_source_map(texels: int, shape: tuple[int, ...]) -> NoReturn:
    """Raise InputError: a stream would hold a source for each of so many texels, in a sample of `shape`."""
    bits = (shape[0] * shape[1] - 1).bit_length()
    raise InputError(
        f"method 'pixel' has no stream: {texels:,} texels with a source of {bits} bits each would take "
        f"{texels * bits / 8e6:.1f} MB; allowed with it: models, texels and pictures"
    )


def open_plan(
    plan: ByteReader,
    charts: tuple[Chart, ...],
    exemplar_shape: tuple[int, int],
    fields: Sequence[WarpField | None] = (),
    budget: PaintBudget | None = None,
) -> PlanDecoder:
    """Return the decoder of a plan, whichever kind it is.

    Parameters
    ----------
    plan
        The plan's bytes.
    charts, exemplar_shape
        As in `Quilt`.
    fields
        Per chart its warp field, None while its nodes have not come; the decoder sees it when they have.
        Empty: the identity everywhere.
    budget
        What painting may cost; by default that of `Limits()`.

    Raises
    ------
    FormatError
        If the plan is malformed.
    """
    kind = plan.byte("kind of plan", FINE_LIST)
    budget = budget or PaintBudget(charts, Limits())
    fields = fields or (WarpField.identity(),) * len(charts)
    if kind == GRID:
        return GridDecoder(plan, charts, exemplar_shape, fields, budget)
    if kind == STRIPS:
        if not all(field is not None and field.is_identity for field in fields):
            raise plan.error("plan has strips where charts have warp fields")
        return StripDecoder(plan, charts, exemplar_shape, budget)
    return ListDecoder(plan, charts, exemplar_shape, fields, budget, fine=kind == FINE_LIST)
