"""The order in which a parcel's new blocks are laid, and how threads share them."""

from collections.abc import Callable
from functools import partial
from threading import Barrier, BrokenBarrierError

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.image.elements._joint_kernels import measure_distances
from upholster.runtime.parallel import report_progress, run_tasks, thread_count
from upholster.synthesis.quilt.block_order import Lists, Near, distances_from, ranks_of
from upholster.synthesis.quilt.centres import Centres
from upholster.synthesis.quilt.kernels._block_kernels import MULTIPLIER, OUTCOME
from upholster.synthesis.quilt.kernels._frame_kernels import KEPT_SHEET
from upholster.synthesis.quilt.laid_blocks import LaidBlocks

__all__ = ["in_order", "share_ranks"]

_NEAR = 1.6
"""Distance in blocks within which a block waits for earlier blocks. Those that touch are less than 1.5 blocks
apart."""

_AVOIDED = 3.2
"""Distance in blocks within which a block avoids the sources of blocks of earlier ranks."""

_ROW = 2.0**20
"""A row is more steps than this after the one above it is, in the order of a flat texture."""

_EACH = 2
"""Mean number of blocks of a rank for each thread: with fewer, starting a thread's share takes too long."""

_FEW = 64
"""Mean number of blocks between two reports of progress, at least."""

_REPORTS = 32
"""Maximum number of reports of progress, each after several ranks of blocks."""


def in_order(
    blocks: LaidBlocks, centres: Centres, *, again: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64], Lists | None]:
    """Return the order of new blocks, the end of each rank, and for each the blocks whose sources it avoids.

    Blocks that are laid over others, `again`, have no lists.
    """
    first, spots = len(blocks.numbers), np.concatenate([blocks.centres.spots, centres.spots])
    near = blocks.plan.near(spots, _NEAR, first=first)
    if again:  # in any order that looks random (Fibonacci hashing): like this, few ranks follow each other
        away = (np.arange(len(centres.steps), dtype=np.uint64) * np.uint64(MULTIPLIER)).astype(np.float64)
    elif blocks.plan.in_rows:
        away = centres.steps[:, 1:] @ np.array([_ROW, 1.0])
    else:
        away = _distances(blocks, near, centres)
    ranks = ranks_of(near, first, np.argsort(away, kind="stable"))
    order = np.lexsort((away, ranks))
    names = np.concatenate([np.arange(first), first + np.argsort(order)])
    ends = first + np.cumsum(np.bincount(ranks))
    if again:
        return order, ends, None
    # Blocks of lower rank are finished when this one is laid, also those for which it does not wait.
    avoided, ranks = blocks.plan.near(spots, _AVOIDED, first=first), np.append(np.full(first, -1), ranks)
    lower = avoided.chosen(ranks[avoided.others] < ranks[avoided.owners])
    return order, ends, lower.earlier(names, first)


def _distances(blocks: LaidBlocks, near: Near, centres: Centres) -> FloatArray:
    # How far each new block is from what is laid already.
    known = np.where(blocks.records[:, OUTCOME] != 0, 0.0, np.inf)
    triangles = np.concatenate([blocks.centres.triangles, centres.triangles])
    normals = blocks.placed.ground.mesh.normals[triangles]
    away = distances_from(near, normals, np.concatenate([known, _from_kept(blocks, centres)]))
    return away[len(known) :]


def _from_kept(blocks: LaidBlocks, centres: Centres) -> FloatArray:
    # The distance of each centre from kept steps on its chart; infinite if none is near it.
    away, plan = np.full(len(centres.steps), np.inf), blocks.plan
    if plan.before is None:
        return away
    canvases = blocks.placed.ground.canvases
    for chart in np.unique(centres.steps[:, 0]).tolist():
        shape = canvases.heights[chart], canvases.widths[chart]
        window = slice(canvases.firsts[chart], canvases.firsts[chart] + shape[0] * shape[1])
        kept, steps = (canvases.sheets[window] == KEPT_SHEET).reshape(shape), np.empty(shape, np.int32)
        measure_distances(kept.view(np.uint8), steps)
        mine = centres.steps[:, 0] == chart
        rows, columns = centres.roots[mine, 1:3].astype(np.int64).T
        away[mine] = steps[rows, columns] / (3 * plan.steps_per_unit)
    return np.where(away < _NEAR * plan.parcels.block, away, np.inf)


def share_ranks(first: int, stops: NDArray[np.int64], lay: Callable[[int, int], None]) -> None:
    """Lay blocks from `first` on, rank by rank, each by all threads; `stops` are the ends of the ranks.

    ``lay(start, stop)`` lays blocks of one rank. Progress has the stage "blocks".
    """
    count, starts = int(stops[-1]) - first, np.append(first, stops[:-1])
    workers = max(1, min(thread_count(), count // (_EACH * len(stops))))
    parts = max(1, min(_REPORTS, len(stops), count // _FEW))
    for ranks in np.array_split(np.column_stack([starts, stops]), parts):
        own, ends = ranks.tolist(), Barrier(workers)
        if workers == 1:  # one after another, without a call for each rank
            own = [(own[0][0], own[-1][1])]
        run_tasks(
            [partial(_lay_share, own, (n, workers), ends, lay) for n in range(workers)], threads=workers
        )
        report_progress("blocks", int(ranks[-1, 1]) - first, count)


def _lay_share(
    ranks: list[tuple[int, int]], share: tuple[int, int], ends: Barrier, lay: Callable[[int, int], None]
) -> None:
    # Lays one thread's share of some ranks: part n of `workers`. All threads end a rank together.
    n, workers = share
    try:
        for start, stop in ranks:
            own = [start + (stop - start) * k // workers for k in (n, n + 1)]
            if own[0] < own[1]:
                lay(own[0], own[1])
            ends.wait()
    except BrokenBarrierError:
        return  # another thread's error is raised
    except BaseException:
        ends.abort()
        raise
