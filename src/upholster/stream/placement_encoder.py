"""Placements to bytes: plan, sources and masks (see `upholster.stream.placements`)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry import SharedEdge
from upholster.quilt import Quilt
from upholster.quilt.model import MASK_CUT
from upholster.stream import _kernels as kernels
from upholster.stream.byte_reader import varint
from upholster.stream.coder import BitWriter
from upholster.stream.grid import recognise_grid
from upholster.stream.grid_encoder import encode_grid
from upholster.stream.records import (
    BATCH,
    FIELD_NAMES,
    FINE,
    GENERAL,
    GRID,
    MAX_CELLS,
    MAX_PLACEMENTS,
    REGULAR,
    beside,
    general_masks,
    strip_masks,
)
from upholster.stream.regular import Regular, recognise

__all__ = ["encode_placements"]

_RECORDS_A_CALL = 256


def encode_placements(quilt: Quilt, shared: Sequence[SharedEdge] = ()) -> tuple[bytes, bytes, bytes]:
    """Encode a quilt's placements.

    Parameters
    ----------
    quilt
        What to encode; cells 0 or 1. Its warp fields are told elsewhere, see `upholster.stream.warp_fields`.
    shared
        Shared edges of the surface, along which blocks may lie on two charts.

    Returns
    -------
    plan, sources, masks : bytes
        What `PlacementDecoder` takes; `masks` is empty where there are none.

    Raises
    ------
    InputError
        For more placements or cells than the format holds, cells other than 0 and 1, or a placement that does
        not touch its chart.
    """
    placed = quilt.placements
    if len(placed) > MAX_PLACEMENTS:
        raise InputError(f"quilt has {len(placed)} placements; allowed: {MAX_PLACEMENTS} in a stream")
    if len(quilt.cells) and quilt.cells.max() > 1:
        raise InputError(f"a cell of the quilt is {quilt.cells.max()}; allowed: 0 and 1")
    plan = None if quilt.fields else recognise(quilt, shared)
    if plan is not None:
        coded = _encode_regular(quilt, plan)
        if coded is not None:
            return bytes([REGULAR]) + plan.payload(), *coded
    outside = beside(placed, quilt.charts)
    # Blocks are transferred to the next chart by their bounding boxes, some of which end right at its edge.
    seen = replace(quilt, placements=placed[~outside]) if outside.any() else quilt
    grid = recognise_grid(seen)
    if grid is not None:
        grid, sources, masks = encode_grid(seen, grid)
        return bytes([GRID]) + grid.payload(quilt.charts), sources, masks
    if outside.any():
        raise InputError(f"placement {int(np.argmax(outside))} does not touch its chart")
    if len(quilt.cells) > MAX_CELLS:
        raise InputError(f"quilt has {len(quilt.cells)} cells; allowed: {MAX_CELLS} in a stream")
    counts = np.bincount(placed["chart"], minlength=len(quilt.charts))
    fine = bool(((placed["source_row"] | placed["source_column"]) & 15).any())
    kind = bytes([FINE if fine else GENERAL])
    head = kind + b"".join(varint(int(count)) for count in counts) + varint(len(quilt.cells))
    return (
        head,
        _encode_fields(placed, fine),
        _encode_masks(quilt.cells, general_masks(placed, len(quilt.cells))),
    )


def _encode_regular(quilt: Quilt, plan: Regular) -> tuple[bytes, bytes] | None:
    """Return sources and masks, or None if the quilt is not what the plan says."""
    placed, first = quilt.placements, plan.runs[:, 0]
    if plan.count > len(placed) or 2 * plan.mask_starts[-1] != len(quilt.cells):
        return None
    edge_blocks = placed[placed["mask"] == MASK_CUT]
    by_cells = edge_blocks[np.argsort(edge_blocks["cells"], kind="stable")]
    own = placed[placed["mask"] != MASK_CUT]
    strip_blocks = plan.count - int(first[len(plan.charts)])
    if len(own) != first[len(plan.charts)] or len(by_cells) != 2 * strip_blocks:
        return None
    chosen = np.concatenate([plan.chosen(own), plan.chosen(by_cells[::2])])
    if (chosen < 0).any():
        return None
    parts = [plan.chart_blocks(n, chosen[first[n] : first[n + 1]]) for n in range(len(plan.charts))]
    cells = [np.zeros(0, np.uint8)]
    for n in range(len(plan.strips)):
        run = len(plan.charts) + n
        parts += plan.strip_blocks(n, chosen[first[run] : first[run + 1]])
        start, stop = plan.mask_starts[n : n + 2].tolist()
        coded = plan.coded_cells(n, quilt.cells[2 * start : 2 * stop])
        if (plan.cells_of(n, coded) != quilt.cells[2 * start : 2 * stop]).any():
            return None
        cells.append(coded)
    expected = np.concatenate(parts)
    expected = expected[np.argsort(expected["chart"], kind="stable")]
    if (expected != placed).any():
        return None
    writer = BitWriter(kernels.SOURCE_COUNTERS, 4)
    modes = np.zeros(len(chosen), np.uint8)
    for (start, across, strip), (end, _, _) in zip(
        plan.runs[:-1].tolist(), plan.runs[1:].tolist(), strict=True
    ):
        writer.room(64 * (end - start) + 64)
        kernels.code_sources(
            *writer.model,
            writer.log,
            chosen,
            modes,
            start,
            end,
            start,
            across,
            strip,
            max(1, plan.step // plan.tile),
            *plan.grid,
            True,
        )
    return writer.finish(), _encode_masks(np.concatenate(cells), list(strip_masks(plan)))


def _encode_fields(placed: NDArray[np.void], fine: bool) -> bytes:
    fields = np.zeros((len(placed), kernels.FIELDS + 1), np.int64)
    for n, name in enumerate(FIELD_NAMES):
        fields[:, n] = placed[name] >> (4 if name.startswith("source") and not fine else 0)
    limits = np.array([[-(2**62), 2**62]] * kernels.FIELDS, np.int64)
    writer = BitWriter(kernels.FIELD_COUNTERS, 1)
    for start in range(0, len(placed), _RECORDS_A_CALL):
        writer.room(2048 * _RECORDS_A_CALL)
        stop = min(len(placed), start + _RECORDS_A_CALL)
        kernels.code_fields(*writer.model, writer.log, fields, limits, 16 if fine else 1, start, stop, True)
    return writer.finish()


def _encode_masks(cells: NDArray[np.uint8], runs: list[tuple[int, int, int, int, int]]) -> bytes:
    if not len(cells):
        return b""
    writer = BitWriter(kernels.CELL_COUNTERS, 3)
    cells = np.array(cells)
    for first, rows, columns, place, end in runs:
        for start in range(first, end, BATCH):
            writer.room(2 * BATCH + 64)
            stop = min(end, start + BATCH)
            kernels.code_cells(*writer.model, cells, start, stop, first, rows, columns, place, True)
    return writer.finish()
