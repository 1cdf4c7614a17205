"""How long a surface takes on many workers: `upholster.tiles` with workers that only wait.

``python -m benchmarks.scaling_model --lay 450 --label 240 --join 60 --paint 150`` takes nanoseconds a texel,
as measured on one worker, and prints minutes and the share of the workers' time that is work.
"""

import argparse
import heapq
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np

import upholster
from upholster.charts.charted import charted_patches
from upholster.charts.layout import density_layout
from upholster.charts.subdivision import subdivided
from upholster.methods.quilt.parcels import Parcels
from upholster.options import WriteOptions
from upholster.paging import PagedAtlas
from upholster.parallel import Key
from upholster.tiles.storage import Place
from upholster.tiles.task_order import _Running
from upholster.tiles.work import TileWork

_TASK = 0.004
"""Seconds that the scheduler takes for a task, whoever does it."""

_BLOCK = 40
"""Texels a side of a block."""


def main() -> None:
    """Print a table: texels, charts, parcels, and minutes by workers."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling_model")
    parser.add_argument("--lay", type=float, default=450)
    parser.add_argument("--label", type=float, default=240)
    parser.add_argument("--join", type=float, default=60)
    parser.add_argument("--paint", type=float, default=150)
    parser.add_argument("--tile", type=int, default=4096)
    parser.add_argument("--texels", type=float, nargs="+", default=[64e6, 1e9, 2e9, 10e9])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 10, 100])
    asked = parser.parse_args()
    for texels in asked.texels:
        # Beyond what one surface may have: as if it might.
        with (
            patch("upholster.charts.layout.MAX_TEXELS", 2**40),
            patch("upholster.model.packing.MAX_PAGES", 10**6),
        ):
            work, costs = _work(int(texels), asked)
        cells = []
        for workers in asked.workers:
            pool = _Waiting(workers, costs)
            run = _Running(work, _Nowhere(""), pool)
            run.lay()
            run.finish()
            cells.append(f"{pool.now / 60:.1f} min ({pool.worked / pool.now / workers:.0%})")
        counts = f"{len(work.parcels_of)} charts, {len(work.plan.parcels)} parcels, {run.tiles} tiles:"
        print(f"{texels / 1e9:g} G: {counts}", *cells)


def _work(texels: int, asked: argparse.Namespace) -> tuple[TileWork, dict[str, Callable[..., float]]]:
    """Return the work, and how many seconds tasks take, by kind."""
    surface = upholster.ring_cyclide(6, 2, 3)
    charts = density_layout(surface, texels=texels, largest=asked.tile - 32)
    charted = charted_patches(surface, charts)
    vectors = np.zeros((len(charted.chart), 3, 3))
    density = float(np.sqrt(texels / charted.mesh.areas.sum()))
    parcels = Parcels.of(charted, vectors, _BLOCK / density, density)
    mesh = subdivided(charted, vectors, parcels.side / 8).surface.mesh if len(parcels) > 1 else charted.mesh
    steps = np.bincount(parcels.of_points(mesh.corners.mean(axis=1)), mesh.areas, len(parcels)) * density**2
    plan: Any = SimpleNamespace(scene=SimpleNamespace(charts=charted.charts), parcels=parcels)
    atlas = PagedAtlas.of(surface, charts, WriteOptions(atlas_size=asked.tile))
    pages = len(atlas.layout.pages)
    work = TileWork(plan, atlas, {}, {}, Place(""))
    return work, {
        "parcel": lambda n: 1e-9 * asked.lay * steps[n],
        "label": lambda n: 1e-9 * asked.label * steps[n],
        "chart": lambda n: 1e-9 * asked.join * charts[n].height * charts[n].width,
        "tile": lambda shown: 1e-9 * asked.paint * texels / pages * len(shown),
    }


class _Nowhere(Place):
    """A folder in which everything is, and is empty."""

    def read(self, name: str) -> bytes:  # noqa: ARG002
        return b""

    def write(self, name: str, data: bytes) -> int:  # noqa: ARG002
        return 0

    def size(self, name: str) -> int:  # noqa: ARG002
        return 0


class _Waiting:
    """A pool whose tasks take a time, and do nothing; `now` is when the last one ended."""

    def __init__(self, width: int, costs: dict[str, Callable[..., float]]) -> None:
        self.width, self.now, self.worked = width, 0.0, 0.0
        self._costs = costs
        self._queue: list[tuple[int, int, Key, float]] = []
        self._running: list[tuple[float, int, Key]] = []
        self._turn = 0

    def submit(
        self,
        key: Key,
        task: Callable[..., Any],  # noqa: ARG002
        *arguments: Any,
        priority: int = 0,
    ) -> None:
        cost = self._costs[key[0]](*arguments[2:]) + _TASK
        self._turn += 1
        heapq.heappush(self._queue, (-priority, self._turn, key, cost))

    def next(self) -> Key:
        while self._queue and len(self._running) < self.width:
            _, turn, key, cost = heapq.heappop(self._queue)
            heapq.heappush(self._running, (self.now + cost, turn, key))
            self.worked += cost
        self.now, _, key = heapq.heappop(self._running)
        return key

    def counts(self) -> dict[str, int]:
        return {}


if __name__ == "__main__":
    main()
