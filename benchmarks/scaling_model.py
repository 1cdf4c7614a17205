"""How long a surface takes on many workers: the order of tasks of `upholster.tiles`, simulated.

``python -m benchmarks.scaling_model --lay 160 --paint 135`` takes nanoseconds a texel, as measured on one
worker, and prints minutes and the share of the workers' time that is work.
"""

import argparse
import heapq
from collections.abc import Sequence
from unittest.mock import patch

import upholster
from upholster.charts.layout import density_layout
from upholster.charts.schedule import schedule
from upholster.charts.seams import find_seams
from upholster.model import by_chart, pack_charts, page_windows
from upholster.quilt.chart import Chart

_TASK = 0.004
"""Seconds that the scheduler takes for a task, whoever does it."""


def main() -> None:
    """Print a table: texels, charts, classes, and minutes by workers."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling_model")
    parser.add_argument("--lay", type=float, default=160)
    parser.add_argument("--paint", type=float, default=135)
    parser.add_argument("--tile", type=int, default=4096)
    parser.add_argument("--texels", type=float, nargs="+", default=[64e6, 1e9, 2e9, 10e9])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 10, 100])
    asked = parser.parse_args()
    surface = upholster.ring_cyclide(6, 2, 3)
    for texels in asked.texels:
        # Beyond what one surface may have: as if it might.
        with (
            patch("upholster.charts.layout.MAX_TEXELS", 2**40),
            patch("upholster.model.packing.MAX_PAGES", 10**6),
        ):
            charts = density_layout(surface, texels=int(texels), largest=asked.tile - 32)
            layout = pack_charts(charts, size=asked.tile)
        seams = find_seams(surface, charts)
        classes, around = schedule(surface, charts, seams), by_chart(seams)
        shown = [
            {*layout.on_page(page), *page_windows(layout, page, around)} for page in range(len(layout.pages))
        ]
        cells = []
        for workers in asked.workers:
            work = texels * (asked.lay + asked.paint) * 1e-9
            took = _seconds(charts, classes, shown, texels, asked, workers)
            cells.append(f"{took / 60:.1f} min ({work / took / workers:.0%})")
        print(
            f"{texels / 1e9:g} G: {len(charts)} charts, {len(classes)} classes, {len(shown)} tiles:", *cells
        )


def _seconds(
    charts: Sequence[Chart],
    classes: Sequence[Sequence[int]],
    shown: Sequence[set[int]],
    texels: float,
    asked: argparse.Namespace,
    workers: int,
) -> float:
    """Return when the last task ends: charts first, tiles where a worker is free."""
    free = [0.0] * workers  # when each worker is
    waiting, ready = [set(one) for one in shown], list[int]()
    tile = 1e-9 * asked.paint * texels / len(shown) + _TASK
    now = 0.0
    for members in classes:
        costs = sorted(1e-9 * asked.lay * charts[n].height * charts[n].width + _TASK for n in members)
        ends = []
        # A worker that paints goes on with that until its tile is done.
        for cost in costs:
            start = max(now, heapq.heappop(free))
            ends.append(start + cost)
            heapq.heappush(free, start + cost)
        later = max(ends)
        while ready and free[0] < later:
            start = max(now, heapq.heappop(free))
            if start >= later:
                heapq.heappush(free, start)
                break
            ready.pop()
            heapq.heappush(free, start + tile)
        now = later
        for page, left in enumerate(waiting):
            before = len(left)
            left.difference_update(members)
            if before and not left:
                ready.append(page)
    for _ in ready:
        heapq.heappush(free, max(now, heapq.heappop(free)) + tile)
    return max(free)


if __name__ == "__main__":
    main()
