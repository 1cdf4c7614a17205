"""Covered surfaces: seams, size and direction of the texture, over exemplars × surfaces, by method "quilt".

``python -m benchmarks.seams [FOLDER …] [-o OUT] [--texels N] [--seed N] [--on SURFACE …] [--publish]``, by
default on the project's examples; see `benchmarks.fidelity` for how exemplars are read. Writes seams.csv,
seams.json and a sheet of pictures per exemplar to OUT. Each exemplar's last row is its flat texture that
wraps both ways. A figure outside its aim is marked with "!".
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity import EXAMPLES, exemplars
from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.measure import Results, one_pixel_a_texel
from benchmarks.tables import write_table
from upholster.geometry import plane, surface_from_spec
from upholster.measure import measure_cover, wrap_seams
from upholster.methods import Exemplar, Scene, execute, prepare
from upholster.options import SynthesisOptions, WriteOptions
from upholster.textured import TexturedModel
from upholster.types import PixelArray

__all__ = ["main", "seams"]

SURFACES = ("cyclide", "torus", "sphere", "vase")
FLAT = "tileable"
SHOT = 640

AIMS: dict[str, tuple[float, float]] = {
    "edges": (0.95, 1.05),
    "edges_matched": (0.95, 1.05),
    "cuts": (0.9, 1.1),
    "cuts_matched": (0.9, 1.1),
    "within": (0.95, 1.0),
    "aligned": (0.95, 1.0),
    "spread": (1.0, 2.1),
    "wrap": (0.95, 1.05),
}


PUBLISHED = {
    "seam ratio across chart borders (1: invisible)": ("edges", "{:.2f}"),
    "chart borders, against the sample": ("edges_matched", "{:.2f}"),
    "seam ratio across block cuts": ("cuts", "{:.2f}"),
    "block cuts, against the sample": ("cuts_matched", "{:.2f}"),
    "area where the size is within 5 %": ("within", "{:.1%}"),
    "area where the direction is within 5°": ("aligned", "{:.1%}"),
    "texel area, 99th over 1st percentile": ("spread", "{:.2f}"),
}
"""Rows of the table: name, field and format."""


@dataclass(frozen=True)
class Row:
    """Figures of one exemplar on one surface; None where one does not apply."""

    exemplar: str
    surface: str
    edges: float | None = None
    edges_matched: float | None = None
    cuts: float | None = None
    cuts_matched: float | None = None
    within: float | None = None
    error_95: float | None = None
    aligned: float | None = None
    angle_95: float | None = None
    stretch_95: float | None = None
    spread: float | None = None
    swd: float | None = None
    copy_ratio: float | None = None
    wrap: float | None = None
    wrap_low: float | None = None
    wrap_high: float | None = None
    texels: int = 0
    charts: int = 0
    placements: int = 0
    seconds: float = 0.0


def seams(results: Results) -> None:
    """Add, for the project's examples, the shares of pairs of exemplar and surface that reach each aim."""
    rows = _measure_all([EXAMPLES], SURFACES, texels=2**20, seed=1, out=None)
    for name, reached in _reached(rows).items():
        low, high = AIMS[name]
        results.add(f"seams, {name} within {low:g} to {high:g}", reached, "of the pairs", aim="1")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.seams", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--texels", type=int, default=2**22)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--on", nargs="+", default=SURFACES, metavar="SURFACE")
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    folders = [folder.resolve() for folder in asked.folders]
    rows = _measure_all(folders, asked.on, texels=asked.texels, seed=asked.seed, out=asked.out)
    _show(rows)
    if asked.publish:
        _publish(rows)
    if asked.out is not None:
        plain = [asdict(row) for row in rows]
        (asked.out / "seams.json").write_text(json.dumps(plain, indent=2) + "\n", encoding="utf-8")
        lines = [",".join(plain[0])]
        lines += [",".join("" if value is None else str(value) for value in row.values()) for row in plain]
        (asked.out / "seams.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def _publish(rows: Sequence[Row]) -> None:
    """Write medians over the exemplars, by surface."""
    surfaces = list(dict.fromkeys(row.surface for row in rows if row.surface != FLAT))

    def medians(field: str, shown: str) -> list[str]:
        return [
            shown.format(float(np.median([getattr(row, field) for row in rows if row.surface == surface])))
            for surface in surfaces
        ]

    table = [[name, *medians(field, shown)] for name, (field, shown) in PUBLISHED.items()]
    count = len({row.exemplar for row in rows})
    note = f"Medians of {count} samples, one seed. Aims of the first four rows: 0.95 to 1.05 and 0.9 to 1.1."
    command = "python -m benchmarks seams FOLDER --publish"
    write_table("seams", ("measure", *surfaces), table, command=command, note=note)


def _measure_all(
    folders: Sequence[Path], specs: Sequence[str], *, texels: int, seed: int, out: Path | None
) -> list[Row]:
    rows = []
    for name, sample in exemplars(folders).items():
        tiles: list[Tile] = []
        for spec in specs:
            row, picture = _covered(name, sample.exemplar, spec, texels, seed, shown=out is not None)
            rows.append(row)
            if picture is not None:
                tiles.append((picture, _caption(row)))
            print("  ".join([name, *_caption(row)]), file=sys.stderr, flush=True)
        row, image = _tiled(name, sample.exemplar, seed)
        rows.append(row)
        twice = np.tile(image, (2, 2, 1))
        tiles.append((twice, _caption(row)))
        if out is not None:
            write_sheet(out / f"{name}.png", tiles)
    return rows


def _covered(
    name: str, exemplar: PixelArray, spec: str, texels: int, seed: int, *, shown: bool
) -> tuple[Row, PixelArray | None]:
    surface = surface_from_spec(spec)
    start = time.perf_counter()
    sample = Exemplar(exemplar)
    scene = prepare(sample, surface, SynthesisOptions(**one_pixel_a_texel(surface, exemplar, texels)))
    assert isinstance(scene, Scene)
    quilt = execute(scene, sample, surface, seed=seed)
    seconds = time.perf_counter() - start
    painted = upholster.paint(quilt, exemplar, density=1.0)
    scale = None if scene.scale is None else scene.scale.scale
    direction, _, _ = scene.direction.partition(", ")  # the default; then its singular points
    found = measure_cover(surface, quilt, exemplar, texels=painted, scale=scale, direction=direction or None)
    assert found.seams is not None
    assert found.mapping is not None
    assert found.scale is not None
    assert found.copies is not None
    row = Row(
        name, spec,
        edges=found.seams.edges, edges_matched=found.seams.edges_matched,
        cuts=found.seams.cuts, cuts_matched=found.seams.cuts_matched,
        within=found.mapping.within, error_95=found.mapping.error_95, aligned=found.mapping.aligned,
        angle_95=found.mapping.angle_95, stretch_95=found.mapping.stretch_95, spread=found.scale.spread,
        swd=found.wasserstein_mean, copy_ratio=found.copies.ratio,
        texels=quilt.steps, charts=len(quilt.charts), placements=len(quilt.placements), seconds=seconds,
    )  # fmt: skip
    if not shown:
        return row, None
    options = WriteOptions(size=(SHOT, SHOT))
    return row, TexturedModel(surface, painted, options, quilt, exemplar).picture()


def _tiled(name: str, exemplar: PixelArray, seed: int) -> tuple[Row, PixelArray]:
    start = time.perf_counter()
    quilt = upholster.synthesize(
        exemplar, plane(), method="quilt", texels=(320, 320), tileable=True, seed=seed
    )
    seconds = time.perf_counter() - start
    image = upholster.paint(quilt, exemplar).arrays[0]
    found = wrap_seams(image)
    assert found is not None
    row = Row(
        name, FLAT, wrap=found.ratio, wrap_low=found.low, wrap_high=found.high,
        texels=quilt.steps, charts=1, placements=len(quilt.placements), seconds=seconds,
    )  # fmt: skip
    return row, image


def _caption(row: Row) -> list[str]:
    if row.surface == FLAT:
        return [
            f"{row.surface}: wrapped edges {_figure(row.wrap)}",
            f"any line {_figure(row.wrap_low)} to {_figure(row.wrap_high)}, {row.seconds:.2f} s",
        ]
    return [
        f"{row.surface}: edges {_figure(row.edges)} ({_figure(row.edges_matched)}), "
        f"cuts {_figure(row.cuts)} ({_figure(row.cuts_matched)})",
        f"size {_percent(row.within)}, direction {_percent(row.aligned)}, {row.seconds:.2f} s",
    ]


def _reached(rows: Sequence[Row]) -> dict[str, float]:
    """Return the share of the rows to which an aim applies that reach it."""
    shares = {}
    for name in AIMS:
        reached = [_reaches(row, name) for row in rows if getattr(row, name) is not None]
        if reached:
            shares[name] = float(np.mean(reached))
    return shares


def _reaches(row: Row, name: str) -> bool:
    low, high = AIMS.get(name, (-np.inf, np.inf))
    if name == "wrap" and row.wrap_low is not None and row.wrap_high is not None:
        low, high = min(low, row.wrap_low), max(high, row.wrap_high)  # as any line of the texture may
    return bool(low <= getattr(row, name) <= high)


def _show(rows: Sequence[Row]) -> None:
    columns: dict[str, Any] = {
        "edges": "edges", "edges_matched": "matched", "cuts": "cuts", "cuts_matched": "matched",
        "within": "size", "error_95": "95 %",
        "aligned": "direction", "angle_95": "95 %, °", "stretch_95": "stretch", "spread": "spread",
        "copy_ratio": "copied", "wrap": "wrapped",
    }  # fmt: skip
    table = Table("exemplar", "surface", *columns.values(), "placements", "s")
    for row in rows:
        figures = [_marked(row, name) for name in columns]
        table.add_row(row.exemplar[:24], row.surface, *figures, str(row.placements), f"{row.seconds:.2f}")
    reached = _reached(rows)
    shares = [f"{100 * reached[name]:.0f} %" if name in reached else "" for name in columns]
    table.add_section()
    table.add_row("reached", "", *shares, "", "")
    Console(width=180).print(table)


def _marked(row: Row, name: str) -> str:
    value = getattr(row, name)
    return "" if value is None else f"{value:.3f}{'' if _reaches(row, name) else ' !'}"


def _figure(value: float | None) -> str:
    return "none" if value is None else f"{value:.3f}"


def _percent(value: float | None) -> str:
    return "none" if value is None else f"{100 * value:.1f} %"


if __name__ == "__main__":
    sys.exit(main())
