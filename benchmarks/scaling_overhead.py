"""What Dask adds to a surface's work: ``python -m benchmarks.scaling_overhead --texels 17e6 40e6``.

Covers the cyclide in tiles by a thread of one process and by one worker in turn, and compares processor time.
Both have run before: kernels and modules are loaded.
"""

import argparse
import importlib
import json
import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import dask

import upholster
from benchmarks.measure import one_pixel_a_texel
from benchmarks.scaling import used, workers_of
from upholster.cluster.job_runs import CALM
from upholster.options import WriteOptions
from upholster.pipeline import cover

distributed: Any = importlib.import_module("distributed")  # it has no types

_SAMPLE = "examples/pebbles.png"


def main() -> None:
    """Print a line of JSON for each size."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling_overhead")
    parser.add_argument("--texels", type=float, nargs="+", default=[17e6])
    parser.add_argument("--tile", type=int, default=2048)
    parser.add_argument("--runs", type=int, default=3)
    asked = parser.parse_args()
    with (
        dask.config.set(CALM),
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0"
        ) as cluster,
    ):
        address = cluster.scheduler_address
        for texels in map(int, asked.texels):
            ways = [(texels, asked.tile, where) for where in (address, "")]
            for way in ways:
                _cover(*way)
            pairs = [[_cover(*way) for way in ways] for _ in range(asked.runs)]
            with_dask, alone = (
                min(column, key=lambda found: found[0]) for column in zip(*pairs, strict=True)
            )
            counts = with_dask[1]
            print(
                json.dumps(
                    {
                        "charts": counts["charts"], "texels": counts["texels"], "tasks": counts["tasks"],
                        "processor seconds": round(alone[0], 2), "with Dask": round(with_dask[0], 2),
                        "more": f"{with_dask[0] / alone[0] - 1:.1%}",
                        "of the worker": round(with_dask[2], 2),
                        "scheduler bytes a task": round(counts["scheduler bytes"] / counts["tasks"]),
                    }
                ), flush=True,
            )  # fmt: skip


def _cover(texels: int, tile: int, address: str) -> tuple[float, dict[str, int], float]:
    """Return processor seconds of all processes, the report's counts, and those of the worker alone."""
    exemplar = upholster.read_exemplar(_SAMPLE)
    found = one_pixel_a_texel(upholster.ring_cyclide(6, 2, 3), exemplar, texels)
    wanted = {"texels": texels, "sample_size": found["sample_size"], "direction": "around:z"}
    running = {"scheduler": address} if address else {"threads": 1}
    with TemporaryDirectory() as folder:
        here, there = time.process_time(), _workers_seconds()
        report = cover(
            exemplar,
            "cyclide",
            [Path(folder, "x.<UDIM>.png")],
            synthesis=wanted,
            options=WriteOptions(atlas_size=tile),
            **running,
        )
        here, there = time.process_time() - here, _workers_seconds() - there
    return here + there, report.counts, there


def _workers_seconds() -> float:
    return sum(found[0] for worker in workers_of(os.getpid()) if (found := used(worker)))


if __name__ == "__main__":
    main()
