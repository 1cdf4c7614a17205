"""Timing and tables."""

import csv
import resource
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.tables import write_table
from upholster.charts.layout import texture_scale
from upholster.geometry import Surface
from upholster.types import PixelArray

__all__ = [
    "EXEMPLAR",
    "Results",
    "median_processor_seconds",
    "median_seconds",
    "one_pixel_a_texel",
    "processor_seconds",
]

EXEMPLAR = Path(__file__).parent.parent / "examples" / "bricks.png"


def one_pixel_a_texel(surface: Surface, exemplar: PixelArray, texels: int) -> dict[str, Any]:
    """Return options with which texels are as large as pixels of the sample, along the patches' rows."""
    width = exemplar.shape[1]
    size = width / texture_scale(surface, width, texels=texels).density
    direction = "u" if len(surface.faces) == 1 else "around:z"
    return {"texels": texels, "sample_size": size, "direction": direction}


def processor_seconds() -> float:
    """Return the processor time so far, in seconds, of this process, its threads and its finished children.

    Other programs on the machine disturb it less than the clock. A program that uses two cores counts twice.
    """
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def median_processor_seconds(function: Callable[[], object], *, runs: int = 7) -> float:
    """Return the median processor time of `runs` calls, after one that is not counted."""
    return _median(function, processor_seconds, runs)


def median_seconds(function: Callable[[], object], *, runs: int = 7) -> float:
    """Return the median time of `runs` calls by the clock, after one that is not counted."""
    return _median(function, time.perf_counter, runs)


def _median(function: Callable[[], object], clock: Callable[[], float], runs: int) -> float:
    function()
    times = []
    for _ in range(runs):
        start = clock()
        function()
        times.append(clock() - start)
    return statistics.median(times)


@dataclass
class Results:
    """Rows of a table: what was measured, figure, unit, aim, and remarks such as the peer's figure."""

    rows: list[tuple[str, str, str, str, str]] = field(default_factory=list)

    def add(self, what: str, figure: float, unit: str, *, aim: str = "", remark: str = "") -> None:
        """Add a row, and show it."""
        self.rows.append((what, f"{figure:.4g}", unit, aim, remark))
        print(
            f"{what}: {figure:.4g} {unit}  {f'(aim {aim})' if aim else ''} {remark}",
            file=sys.stderr,
            flush=True,
        )

    def show(self) -> None:
        """Print all rows as a table."""
        table = Table("measured", "figure", "unit", "aim", "remark")
        for row in self.rows:
            table.add_row(*row)
        Console(width=140).print(table)

    def publish(self, name: str, *, command: str, peers: str = "", note: str = "") -> None:
        """Write all rows as a table of docs/benchmarks.md; aims are not shown there."""
        rows = [(what, f"{figure} {unit}".strip(), remark) for what, figure, unit, _, remark in self.rows]
        columns = ("what", "figure", "compared with")
        write_table(name, columns, rows, command=command, peers=peers, note=note)

    def write(self, path: Path) -> None:
        """Write all rows as CSV, aims included."""
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("measured", "figure", "unit", "aim", "remark"))
            writer.writerows(self.rows)
