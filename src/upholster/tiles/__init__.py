"""Surfaces larger than memory, and one surface on many workers: parcel by parcel, tile by tile.

plan ──► parcels' blocks, class after class ──► parcels' labels ──► charts ──► tiles

Each is a task, and runs as soon as what it waits for is there. All that goes from task to task lies in a
folder beside the outputs, on a disk or behind a URL: who lays a parcel, or tells its labels, reads its
neighbours' blocks there, and who paints a tile its charts. What was done stays done when a worker or the
whole run is killed.

`storage` is that folder, `task_files` the bytes of what lies there, `work` what a task does, `task_order` the
order of tasks, `covering` what `upholster.pipeline` calls. Tasks run on threads (`upholster.parallel`) or on
Dask's workers (`upholster.cluster`).
"""

from upholster.tiles.covering import are_tiles_alone, check_tasks, spread_quilt, task_pool, tiled

__all__ = ["are_tiles_alone", "check_tasks", "spread_quilt", "task_pool", "tiled"]
