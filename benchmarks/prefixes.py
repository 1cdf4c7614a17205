"""What the first bytes of a stream show, of README's ring, a ring of pebbles, the chair and further meshes.

PSNR of all texels against those of the complete stream, at 1 to 32 kB. With ``-o`` prefixes.csv has more
points.
"""

import csv
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import EXAMPLES, EXEMPLAR, Request
from benchmarks.tables import Table
from upholster.codec.stream.reader import StreamDecoder
from upholster.output.levels import texels_psnr
from upholster.pipeline import cover
from upholster.quilt.painting import paint

__all__ = ["measured"]

SIZES = (1000, 2000, 4000, 8000, 16_000, 32_000)
LABELS = {"ring": "README's ring", "pebbles": "a ring of pebbles", "chair": "`chair.glb`"}

Curve = list[tuple[int, float]]


def measured(request: Request) -> Table:
    """Make the streams, and measure their prefixes."""
    curves, rows = dict[str, Curve](), []
    with tempfile.TemporaryDirectory() as folder:
        for name, path in _streams(Path(folder), request.files).items():
            data = path.read_bytes()
            curves[name] = _curve(data)
            at_sizes = {length: "base" if np.isnan(psnr) else f"{psnr:.1f}" for length, psnr in curves[name]}
            shown = [at_sizes.get(size, "") for size in SIZES]
            sizes = (len(data), *_ends(data))
            rows.append([LABELS.get(name, name), *(f"{size / 1000:.1f} kB" for size in sizes), *shown])
            print(*rows[-1], sep="; ", file=sys.stderr, flush=True)
    if request.out is not None:
        with (request.out / "prefixes.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("model", "bytes", "dB"))
            for name, curve in curves.items():
                writer.writerows((name, n, "base" if np.isnan(psnr) else f"{psnr:.2f}") for n, psnr in curve)
    columns = (
        "model",
        "stream",
        "first view",
        "surface",
        "every chart placed",
        *(f"{n // 1000} kB" for n in SIZES),
    )
    note = "PSNR in dB of all texels against those of the complete stream; a base has other texels."
    return Table(columns, rows, {"note": note})


def _streams(folder: Path, meshes: Sequence[Path]) -> dict[str, Path]:
    ring = {"sample_size": 5.0, "direction": "around:z"}
    cases: dict[str, tuple[Path, str | Path, dict[str, Any]]] = {
        "ring": (EXEMPLAR, "cyclide", {**ring, "texels": 4_000_000}),
        "pebbles": (EXAMPLES / "pebbles.png", "cyclide", {"sample_size": 5.0, "texels": 1_000_000}),
        "chair": (EXAMPLES / "weave.png", EXAMPLES / "chair.glb", {}),
        **{mesh.stem: (EXEMPLAR, mesh, {}) for mesh in meshes},
    }
    made = {name: folder / f"prefixes-{name}.uph" for name in cases}
    for name, (sample, on, synthesis) in cases.items():
        cover(sample, on, made[name], synthesis=synthesis, seed=3)
    return made


def _curve(data: bytes) -> Curve:
    whole = StreamDecoder()
    whole.feed(data)
    best = whole.texels()
    decoder, place = StreamDecoder(), 0
    found = []
    lengths = {*SIZES, *np.geomspace(600, len(data), 32).astype(int).tolist()}
    for length in sorted(n for n in lengths if n < len(data)):
        decoder.feed(data[place:length])
        place = length
        if not decoder.needed:
            now = paint(decoder.quilt(), decoder.exemplar(), density=whole.density)
            found.append((length, texels_psnr(now, best)))
    return found


def _ends(data: bytes) -> tuple[int, int, int]:
    """Return the bytes until the first view, until surface and layout, and until every chart has a block."""
    decoder, view, surface = StreamDecoder(), 0, 0
    for place in range(0, len(data), 64):
        decoder.feed(data[place : place + 64])
        if not decoder.needed:
            view = view or decoder.received
            surface = surface or (0 if decoder.is_base else decoder.received)
            if decoder.charts_known == len(decoder.charts):
                break
    return view, surface, decoder.received
