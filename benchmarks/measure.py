"""Timing and tables."""

import csv
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from upholster.charts.layout import texture_scale
from upholster.geometry import Surface
from upholster.types import PixelArray

__all__ = ["EXEMPLAR", "Results", "median_seconds", "one_pixel_a_texel"]

EXEMPLAR = Path(__file__).parent.parent / "examples" / "bricks.png"


def one_pixel_a_texel(surface: Surface, exemplar: PixelArray, texels: int) -> dict[str, Any]:
    """Return options with which texels are as large as pixels of the sample, along the patches' rows."""
    width = exemplar.shape[1]
    size = width / texture_scale(surface, width, texels=texels).density
    direction = "u" if len(surface.faces) == 1 else "around:z"
    return {"texels": texels, "sample_size": size, "direction": direction}


def median_seconds(function: Callable[[], object], *, runs: int = 7) -> float:
    """Return the median time of `runs` calls, after one that is not counted."""
    function()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
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

    def write(
        self, path: Path, headings: Sequence[str] = ("measured", "figure", "unit", "aim", "remark")
    ) -> None:
        """Write all rows as CSV."""
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(headings)
            writer.writerows(self.rows)
