"""Surfaces larger than memory, and one surface on many workers: chart by chart, tile by tile.

prepared run ──► charts, class after class ──► files of charts ──► tiles, each when its charts are there

All that goes from task to task lies in a folder beside the outputs, on a disk or behind a URL: who lays a
chart reads its neighbours' overhangs there, who paints a tile reads its charts. No task needs more than one
chart and its neighbours, and what was done stays done when a worker or the whole run is killed.

`places` is that folder, `chart_files` the bytes of a chart, `work` what a task does, `running` the order of
tasks, `covering` what `upholster.pipeline` calls. Tasks run on threads (`upholster.parallel`) or on Dask's
workers (`upholster.cluster`).
"""

from upholster.tiles.covering import are_tiles_alone, check_tasks, spread_quilt, task_pool, tiled

__all__ = ["are_tiles_alone", "check_tasks", "spread_quilt", "task_pool", "tiled"]
