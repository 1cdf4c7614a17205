"""Surfaces larger than memory, and one surface on many workers: parcel by parcel, tile by tile.

plan ──► parcels' blocks, class after class ──► parcels' labels ──► charts ──► tiles

Each of these is a task, and runs as soon as its inputs are ready. All data between tasks is in a folder next
to the outputs, on a disk or at a URL. A task that lays or labels a parcel reads its neighbours' blocks there,
and a task that paints a tile reads its charts. Finished work is kept when a worker or the whole run is
killed.

`storage` is that folder, `task_files` the format of its files, `work` the content of tasks, `task_order`
their order, `by_tasks` the entry points for `upholster.pipeline`. Tasks run on threads (`upholster.parallel`)
or on Dask's workers (`upholster.cluster`).
"""

from upholster.tiles.by_tasks import are_tiles_alone, check_tasks, spread_quilt, task_pool, tiled

__all__ = ["are_tiles_alone", "check_tasks", "spread_quilt", "task_pool", "tiled"]
