"""Placements of method "quilt" to bytes (see `upholster.stream.grid`)."""

import numpy as np
from numpy.typing import NDArray

from upholster.quilt import Quilt
from upholster.quilt.model import MASK_CUT
from upholster.stream import _grid_kernels as kernels
from upholster.stream import _mask_kernels as mask_kernels
from upholster.stream._block_records import COLUMN, ROW
from upholster.stream.coder import BitWriter
from upholster.stream.grid import GridPlan, records_of
from upholster.stream.grid_decoder import matrices_of
from upholster.stream.links import with_links

__all__ = ["encode_grid"]

_BYTES_A_BLOCK = 512


def encode_grid(quilt: Quilt, plan: GridPlan) -> tuple[GridPlan, bytes, bytes]:
    """Encode a quilt whose blocks lie as the plan says.

    Everything that painting shows comes back; cells that no texel shows come back as 1, and all masks follow
    each other in coded order.

    Returns
    -------
    plan, sources, masks
        The plan with the charts in a better order, and the bytes.
    """
    plan, records = with_links(plan, [records_of(quilt.on_chart(n)) for n in range(len(quilt.charts))])
    sources = BitWriter(kernels.BLOCK_COUNTERS, kernels.BLOCK_INPUTS)
    masks = BitWriter(mask_kernels.MASK_COUNTERS, mask_kernels.MASK_INPUTS)
    for place in range(len(plan.order)):
        _code_sources(sources, quilt, plan, place, records)
    cells, first = _masks_in_order(quilt, plan)
    for place, n in enumerate(plan.order):
        start, stop = plan.starts[place : place + 2].tolist()
        masks.room(2 * int(plan.charts[n].cells_of(records[start:stop]).sum()) + 64)
        mask_kernels.code_masks(
            *masks.model,
            records,
            first,
            cells,
            np.zeros((quilt.charts[n].height, quilt.charts[n].width), np.uint8),
            plan.charts[n].transferred,
            plan.charts[n].cell,
            plan.feather,
            start,
            stop,
            start,
            0,
            True,
        )
    return plan, sources.finish(), masks.finish() if len(cells) else b""


def _code_sources(
    writer: BitWriter, quilt: Quilt, plan: GridPlan, place: int, records: NDArray[np.int32]
) -> None:
    n = plan.order[place]
    chart = plan.charts[n]
    matrices, margin = matrices_of(quilt.fields[n] if quilt.fields else None)
    start, stop = plan.starts[place : place + 2].tolist()
    own = records[start + chart.transferred : stop]
    there = np.zeros(chart.positions, np.uint8)
    there[
        (own[:, ROW] - chart.first_row) // chart.step_row * chart.across
        + (own[:, COLUMN] - chart.first_column) // chart.step_column
    ] = 1
    end = chart.transferred + chart.positions
    writer.room(_BYTES_A_BLOCK * end + 64)
    kernels.code_blocks(
        *writer.model,
        writer.log,
        records,
        plan.starts,
        place,
        there,
        np.full((chart.rows + 2, chart.across + 2), -1, np.int32),
        matrices,
        chart.numbers(margin, quilt.exemplar_shape, start),
        0,
        end,
        True,
    )


def _masks_in_order(quilt: Quilt, plan: GridPlan) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    # All masks one after another, and where each block's cells begin.
    parts, counts = [np.zeros(0, np.uint8)], [np.zeros(0, np.int64)]
    for n in plan.order:
        placed = quilt.on_chart(n)
        count = np.where(placed["mask"] == MASK_CUT, plan.charts[n].cells_of(records_of(placed)), 0)
        counts.append(count)
        parts += [
            quilt.cells[at : at + size] for at, size in zip(placed["cells"], count, strict=True) if size
        ]
    sizes = np.concatenate(counts)
    return np.concatenate(parts), np.cumsum(sizes) - sizes
