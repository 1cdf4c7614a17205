"""Guides, labels and zones: how much of what is asked for is shown, and what it costs, flat and on a torus.

Of a folder's first five images by name, each reduced to 256². A disc is asked for as labels, a ramp as a
guide, and a half as a zone of the next image.
"""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import EXAMPLES, Request
from benchmarks.tables import Table
from upholster import paint, read_exemplar, synthesize
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import FloatArray, PixelArray
from upholster.covering.measure.cuts import sampled
from upholster.covering.measure.samples import SEED, coded
from upholster.covering.measure.seams import MeanDifference
from upholster.covering.measure.trace import step_sources, traces
from upholster.image.files.material import Material
from upholster.image.files.write import IMAGE_SUFFIXES, write_image
from upholster.quilt.model import Quilt
from upholster.synthesis.guidance_reader import read_guidance

__all__ = ["measured"]

SIDE, COUNT, MOST_CUTS = 256, 5, 1 << 14
SURFACES: dict[str, dict[str, Any]] = {
    "plane": {"texels": (768, 768)},
    "torus:R=2,r=0.9": {"texels": 600_000, "sample_size": 2.5},
}


FIGURES: dict[str, tuple[str, str, str]] = {
    "area that shows the label asked for": ("labels", "labels_none", "{:.0%}"),
    "correlation of a guide's shown and wanted values": ("correlation", "correlation_none", "{:.2f}"),
    "their root mean square difference, of 1": ("off", "off_none", "{:.2f}"),
    "seam ratio at cuts, with a guide": ("cuts", "cuts_none", "{:.2f}"),
    "seam ratio at cuts, inside zones": ("cuts_inside", "", "{:.2f}"),
    "seam ratio at cuts, between zones": ("cuts_between", "", "{:.2f}"),
    "time with a guide, times that without": ("guide_time", "", "{:.1f}"),
}
"""Rows of the table: name, figure, the same without a guide, and format."""


def measured(request: Request) -> Table:
    """Return means over the samples, on either surface with and without a guide."""
    paths = (request if request.files else Request((EXAMPLES,))).listed(IMAGE_SUFFIXES)[:COUNT]
    with tempfile.TemporaryDirectory() as made:
        files = []
        for path in paths:
            files.append(Path(made, path.name).with_suffix(".png"))
            pixels = read_exemplar(path, resize=(SIDE, SIDE))
            write_image(files[-1], np.ascontiguousarray(np.broadcast_to(pixels, (SIDE, SIDE, 3))))
        found = {
            surface: [_figures(*pair, surface) for pair in zip(files, [*files[1:], files[0]], strict=True)]
            for surface in SURFACES
        }
    rows = []
    for name, (figure, without, shown) in FIGURES.items():
        cells = []
        for own in found.values():
            cells += [shown.format(np.mean([one[x] for one in own])) for x in (figure, without) if x]
            cells += [""] * (not without)
        rows.append([name, *cells])
    columns = ("measure", "flat", "flat, unguided", "torus", "torus, unguided")
    return Table(columns, rows, {"note": f"Means of {len(paths)} photographs."})


def _figures(file: Path, other: Path, surface: str) -> dict[str, float]:
    exemplar = read_exemplar(file)
    shown = _luminance(exemplar)
    is_light = shown > np.median(shown)
    y, x = np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]
    disc, ramp = np.hypot(x, y) < 0.6, (x + 1) / 2
    files = {"own": is_light, "disc": disc, "ramp": ramp, "half": x > 0}
    for name, values in files.items():
        write_image(file.with_name(f"_{name}.png"), np.rint(255 * values[:, :, None]).astype(np.uint8))
    uses: dict[str, dict[str, Any]] = {
        "none": {},
        "labels": {"labels": f"{file.parent}/_own.png={file.parent}/_disc.png"},
        "guide": {"guide": f"luminance={file.parent}/_ramp.png"},
        "zones": {"zone": f"{other}={file.parent}/_half.png"},
    }
    quilts, seconds = {}, {}
    for name, one in uses.items():
        options = SynthesisOptions(**SURFACES[surface], **one)
        quilts[name], seconds[name] = _laid(exemplar, surface, options)
    whole, _ = read_guidance(options, exemplar, SampleOptions(), None)  # the last one's: zones
    assert isinstance(whole, Material)
    found = {"guide_time": seconds["guide"] / seconds["none"]}
    for name, ending in (("none", "_none"), ("labels", "")):
        label, wanted = _compared(quilts[name], is_light.astype(np.float64), disc.astype(np.float64))
        found[f"labels{ending}"] = float(((label > 0.5) == (wanted > 0.5)).mean())
    for name, ending in (("none", "_none"), ("guide", "")):
        value, wanted = _compared(quilts[name], shown, ramp)
        found[f"correlation{ending}"] = float(np.corrcoef(value, wanted)[0, 1])
        found[f"off{ending}"] = float(np.sqrt(np.mean((value - wanted) ** 2)))
        found[f"cuts{ending}"], _ = _cut_ratios(quilts[name], exemplar, exemplar.shape[1])
    zones = _cut_ratios(quilts["zones"], whole.maps["albedo"], exemplar.shape[1])
    found["cuts_inside"], found["cuts_between"] = zones
    return found


def _luminance(exemplar: PixelArray) -> FloatArray:
    options = SynthesisOptions(guide=("luminance=height",))
    _, guidance = read_guidance(options, exemplar, SampleOptions(), None)
    assert guidance is not None
    return guidance.guides[0].shown / 255


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
            cuts = rng.permutation(np.flatnonzero(border.cut))[:MOST_CUTS]
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
