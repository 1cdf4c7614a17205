"""Guides, labels and zones: how much of what is asked for is shown, and what it costs, flat and on a torus.

``python -m benchmarks guides FOLDER [--publish]``, by default of the project's examples: the first five
images by name, each reduced to 256². What is asked for is a disc as labels, a ramp as a guide, and a half
as a zone of the next image.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fidelity import EXAMPLES
from benchmarks.measure import Results
from benchmarks.tables import write_table
from upholster import paint, read_exemplar, synthesize
from upholster.image import IMAGE_SUFFIXES, Material, write_image
from upholster.measure.cuts import sampled
from upholster.measure.samples import SEED, coded
from upholster.measure.seams import MeanDifference
from upholster.measure.trace import step_sources, traces
from upholster.methods.guided import read_guidance
from upholster.options import SampleOptions, SynthesisOptions
from upholster.quilt import Quilt
from upholster.types import FloatArray, PixelArray

__all__ = ["Row", "guides", "main", "measure"]

SIDE, COUNT, MOST_CUTS = 256, 5, 1 << 14
SURFACES: dict[str, dict[str, Any]] = {
    "plane": {"texels": (768, 768)},
    "torus:R=2,r=0.9": {"texels": 600_000, "sample_size": 2.5},
}


@dataclass(frozen=True)
class Row:
    """Figures of one sample on one surface; `none`: the same without a guide.

    Attributes
    ----------
    labels, labels_none
        Share of the area that shows the label asked for.
    correlation, correlation_none, off, off_none
        Between what a guide's shown values and the wanted ones are, and their root mean square difference.
    cuts, cuts_none
        Differences at cuts against what the sample has there, with a guide.
    cuts_inside, cuts_between
        The same with two zones: inside them, and between them.
    guide_time, label_time
        Seconds with a guide over seconds without, and with labels.
    """

    sample: str
    surface: str
    labels: float
    labels_none: float
    correlation: float
    correlation_none: float
    off: float
    off_none: float
    cuts: float
    cuts_none: float
    cuts_inside: float
    cuts_between: float
    guide_time: float
    label_time: float


def guides(results: Results, folder: Path = EXAMPLES) -> None:
    """Add means of five samples on either surface."""
    rows = measure(folder)
    for surface in SURFACES:
        own = [row for row in rows if row.surface == surface]
        for entry in fields(Row)[2:]:
            mean = float(np.mean([getattr(row, entry.name) for row in own]))
            results.add(f"guides, {surface}: {entry.name}", mean, "")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks guides", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=EXAMPLES, metavar="FOLDER")
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    names = [entry.name for entry in fields(Row)]
    table = Table(*names)
    rows = measure(asked.folder)
    if asked.publish:
        _publish(rows)
    for row in rows:
        table.add_row(
            *(x if isinstance(x, str) else f"{x:.2f}" for x in (getattr(row, name) for name in names))
        )
    for surface in SURFACES:
        own = [row for row in rows if row.surface == surface]
        means = (float(np.mean([getattr(row, name) for row in own])) for name in names[2:])
        table.add_row("mean", surface, *(f"{mean:.3f}" for mean in means))
    Console(width=180).print(table)
    return 0


PUBLISHED: dict[str, tuple[str, str, str]] = {
    "area that shows the label asked for": ("labels", "labels_none", "{:.0%}"),
    "correlation of a guide's shown and wanted values": ("correlation", "correlation_none", "{:.2f}"),
    "their root mean square difference, of 1": ("off", "off_none", "{:.2f}"),
    "seam ratio at cuts, with a guide": ("cuts", "cuts_none", "{:.2f}"),
    "seam ratio at cuts, inside zones": ("cuts_inside", "", "{:.2f}"),
    "seam ratio at cuts, between zones": ("cuts_between", "", "{:.2f}"),
    "time with a guide, times that without": ("guide_time", "", "{:.1f}"),
}
"""Rows of the table: name, field, field without a guide, and format."""


def _publish(rows: Sequence[Row]) -> None:
    """Write means over the samples, on either surface with and without a guide."""
    table = []
    for name, (field, without, shown) in PUBLISHED.items():
        cells = []
        for surface in SURFACES:
            own = [row for row in rows if row.surface == surface]
            means = [float(np.mean([getattr(row, x) for row in own])) for x in (field, without) if x]
            cells += [shown.format(mean) for mean in means] + [""] * (not without)
        table.append([name, *cells])
    columns = ("measure", "flat", "flat, unguided", "torus", "torus, unguided")
    note = f"Means of {len(rows) // len(SURFACES)} photographs."
    write_table("guides", columns, table, command="python -m benchmarks guides FOLDER --publish", note=note)


def measure(folder: Path, surfaces: Sequence[str] = tuple(SURFACES)) -> list[Row]:
    """Return the figures of a folder's first five images."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)[:COUNT]
    with tempfile.TemporaryDirectory() as made:
        files = []
        for path in paths:
            files.append(Path(made, path.name).with_suffix(".png"))
            pixels = read_exemplar(path, resize=(SIDE, SIDE))
            write_image(files[-1], np.ascontiguousarray(np.broadcast_to(pixels, (SIDE, SIDE, 3))))
        return [
            _measured(file, other, surface)
            for file, other in zip(files, [*files[1:], files[0]], strict=True)
            for surface in surfaces
        ]


def _measured(file: Path, other: Path, surface: str) -> Row:
    exemplar = read_exemplar(file)
    shown = _luminance(exemplar)
    is_light = shown > np.median(shown)
    y, x = np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]
    disc, ramp = np.hypot(x, y) < 0.6, (x + 1) / 2
    files = {"own": is_light, "disc": disc, "ramp": ramp, "half": x > 0}
    for name, values in files.items():
        write_image(file.with_name(f"_{name}.png"), np.rint(255 * values[:, :, None]).astype(np.uint8))
    asked: dict[str, dict[str, Any]] = {
        "none": {},
        "labels": {"labels": f"{file.parent}/_own.png={file.parent}/_disc.png"},
        "guide": {"guide": f"luminance={file.parent}/_ramp.png"},
        "zones": {"zone": f"{other}={file.parent}/_half.png"},
    }
    quilts, seconds = {}, {}
    for name, one in asked.items():
        options = SynthesisOptions(**SURFACES[surface], **one)
        quilts[name], seconds[name] = _laid(exemplar, surface, options)
    whole, _ = read_guidance(options, exemplar, SampleOptions(), None)  # the last one's: zones
    assert isinstance(whole, Material)
    found = {}
    for name in ("none", "labels"):
        label, wanted = _compared(quilts[name], is_light.astype(np.float64), disc.astype(np.float64))
        found[f"labels_{name}"] = float(((label > 0.5) == (wanted > 0.5)).mean())
    for name in ("none", "guide"):
        value, wanted = _compared(quilts[name], shown, ramp)
        found[f"correlation_{name}"] = float(np.corrcoef(value, wanted)[0, 1])
        found[f"off_{name}"] = float(np.sqrt(np.mean((value - wanted) ** 2)))
        found[f"cuts_{name}"], _ = _cut_ratios(quilts[name], exemplar, exemplar.shape[1])
    inside, between = _cut_ratios(quilts["zones"], whole.maps["albedo"], exemplar.shape[1])
    return Row(
        file.stem, surface, found["labels_labels"], found["labels_none"], found["correlation_guide"],
        found["correlation_none"], found["off_guide"], found["off_none"],
        found["cuts_guide"], found["cuts_none"], inside, between,
        seconds["guide"] / seconds["none"], seconds["labels"] / seconds["none"],
    )  # fmt: skip


def _luminance(exemplar: PixelArray) -> FloatArray:
    asked = SynthesisOptions(guide=("luminance=height",))
    _, guidance = read_guidance(asked, exemplar, SampleOptions(), None)
    return (guidance.guides[0].shown.astype(np.float64) - 1) / 254


def _laid(exemplar: PixelArray, surface: str, options: SynthesisOptions) -> tuple[Quilt, float]:
    # The best of three: what is found out of the sample alone is known after the first.
    times = []
    for _ in range(3):
        start = time.perf_counter()
        quilt = synthesize(exemplar, surface, options=options, seed=1)
        times.append(time.perf_counter() - start)
    return quilt, min(times)


def _compared(quilt: Quilt, shown: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what a map of the sample and an image over each face are at texels that are shown, (n,)."""
    texels = paint(quilt, np.rint(255 * shown[:, :, None]).astype(np.uint8), density=1.0)
    values, targets = [], []
    faces = np.zeros((1 + max(chart.face for chart in texels.charts), 2))
    for chart in texels.charts:
        faces[chart.face] = np.maximum(faces[chart.face], (chart.s1, chart.t1))
    for chart, array in zip(texels.charts, texels.arrays, strict=True):
        s = chart.s0 + (chart.s1 - chart.s0) * (np.arange(chart.height) + 0.5) / chart.height
        t = chart.t0 + (chart.t1 - chart.t0) * (np.arange(chart.width) + 0.5) / chart.width
        at = s / faces[chart.face, 0], t / faces[chart.face, 1]
        rows, columns = (np.minimum((part * len(wanted)).astype(int), len(wanted) - 1) for part in at)
        values.append(array[:, :, 0].ravel() / 255)
        targets.append(wanted[rows[:, None], columns].ravel())
    return np.concatenate(values), np.concatenate(targets)


def _cut_ratios(quilt: Quilt, exemplar: PixelArray, width: int) -> tuple[float, float]:
    """Return differences at cuts against what the samples have there: inside zones, and between them.

    The samples lie side by side, the first one `width` pixels wide.
    """
    texels = paint(quilt, exemplar, density=1.0)
    rng, levels = np.random.default_rng(SEED), [exemplar]
    sums: dict[bool, tuple[MeanDifference, MeanDifference]] = {
        is_between: (MeanDifference(), MeanDifference()) for is_between in (False, True)
    }
    for trace in traces(quilt):
        pixels = trace.window.of(texels.arrays[trace.window.index])
        for axis in (0, 1):
            border = trace.border(axis)
            cuts = rng.permutation(np.flatnonzero(~border.continued))[:MOST_CUTS]
            rows, columns = border.rows[cuts], border.columns[cuts]
            at = [(rows, columns), (rows + (axis == 0), columns + (axis == 1))]
            owners = (border.first[cuts], border.second[cuts])
            inside = [(r + trace.window.row, c + trace.window.column) for r, c in at]
            places = [[step_sources(trace.field, owner, *x).T / 16 for x in inside] for owner in owners]
            met = (places[0][0][:, 1] < width) != (places[1][1][:, 1] < width)
            for is_between, (seen, expected) in sums.items():
                own = met == is_between
                seen.add(*(coded(pixels[r[own], c[own]]) for r, c in at))
                for owner, pair in zip(owners, places, strict=True):
                    expected.add(*(sampled(trace, owner[own], place[own], levels) for place in pair))
    ratios = [seen.over(expected) or np.nan for seen, expected in sums.values()]
    return ratios[0], ratios[1]
