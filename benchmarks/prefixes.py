"""What the first bytes of a stream show, of README's ring, a ring of pebbles, the chair and further meshes.

PSNR of all texels against those of the complete stream, 1 to 32 kB after the surface itself. With ``-o``
prefixes.csv has more points.
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
            surface = _surface_bytes(data)
            curves[name] = _curve(data, surface)
            at_sizes = dict(curves[name])
            shown = [f"{at_sizes[size]:.1f}" if size in at_sizes else "" for size in SIZES]
            sizes = (len(data), surface, _own_at(data))
            rows.append([LABELS.get(name, name), *(f"{size / 1000:.1f} kB" for size in sizes), *shown])
            print(*rows[-1], sep="; ", file=sys.stderr, flush=True)
    if request.out is not None:
        with (request.out / "prefixes.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(("model", "bytes after the surface", "dB"))
            writer.writerows((name, n, f"{psnr:.2f}") for name, curve in curves.items() for n, psnr in curve)
    columns = (
        "model",
        "stream",
        "of it surface",
        "every chart placed at",
        *(f"{n // 1000} kB" for n in SIZES),
    )
    note = "PSNR in dB of all texels against those of the complete stream; bytes after the surface."
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


def _surface_bytes(data: bytes) -> int:
    # A mesh takes many bytes before there is anything to lay texture on.
    decoder = StreamDecoder()
    decoder.feed(data)
    return next(chunk.payload_offset + chunk.length + 4 for chunk in decoder.chunks if chunk.tag == "S")


def _curve(data: bytes, surface: int) -> Curve:
    whole = StreamDecoder()
    whole.feed(data)
    best = whole.texels()
    decoder, place = StreamDecoder(), 0
    found = []
    lengths = {*SIZES, *np.geomspace(600, len(data) - surface, 32).astype(int).tolist()}
    for length in sorted(n for n in lengths if surface + n < len(data)):
        decoder.feed(data[place : surface + length])
        place = surface + length
        if not (decoder.needed or decoder.is_base):
            now = paint(decoder.quilt(), decoder.exemplar(), density=whole.density)
            found.append((length, texels_psnr(now, best)))
    return found


def _own_at(data: bytes) -> int:
    decoder = StreamDecoder()
    for place in range(0, len(data), 64):
        decoder.feed(data[place : place + 64])
        if decoder.charts and decoder.charts_known == len(decoder.charts):
            break
    return decoder.received - _surface_bytes(data)
