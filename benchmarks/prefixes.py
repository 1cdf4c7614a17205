"""What the first bytes of a stream show.

``python -m benchmarks.prefixes [--mesh FILE …] -o OUT [--publish]``

The PSNR of all texels against those of the complete stream, 1, 2, 4, 8, 16 and 32 kB after the surface
itself: for README's ring, a ring of pebbles, the chair of the examples and further meshes. Writes
``prefixes.csv``, ``prefixes.png`` with a curve each, and ``prefixes.jpg`` with pictures, to OUT.
"""

import argparse
import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import EXEMPLAR
from benchmarks.tables import write_table
from upholster.image import read_image, write_image
from upholster.image.drawing import Drawing
from upholster.levels import texels_psnr
from upholster.options import WriteOptions
from upholster.pipeline import cover
from upholster.quilt import paint
from upholster.refining import refine
from upholster.stream import StreamDecoder
from upholster.stream.prefix import Limit
from upholster.types import PixelArray

__all__ = ["main"]

SIZES = (1000, 2000, 4000, 8000, 16_000, 32_000)
EXAMPLES = EXEMPLAR.parent
LABELS = {"ring": "README's ring", "pebbles": "a ring of pebbles", "chair": "`chair.glb`"}
COLORS = ((0.75, 0.25, 0.1), (0.1, 0.55, 0.2), (0.1, 0.35, 0.7), (0.5, 0.2, 0.6), (0.5, 0.5, 0.1))
VIEW, SIDE = (150.0, 32.0), 320

Curve = list[tuple[int, float]]


def main(argv: list[str] | None = None) -> int:
    """Make the streams, measure their prefixes, print and write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.prefixes", description=__doc__)
    parser.add_argument("--mesh", type=Path, nargs="*", default=[])
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    curves, rows, pictures = dict[str, Curve](), [], []
    for name, path in _streams(options.out, options.mesh).items():
        data = path.read_bytes()
        surface = _surface_bytes(data)
        curves[name] = _curve(data, surface)
        at_sizes = dict(curves[name])
        shown = [f"{at_sizes[size]:.1f}" if size in at_sizes else "" for size in SIZES]
        sizes = (len(data), surface, _own_at(data))
        rows.append([LABELS.get(name, name), *(f"{size / 1000:.1f} kB" for size in sizes), *shown])
        print(*rows[-1], sep="; ")
        pictures.append([_picture(path, surface + size, options.out) for size in SIZES[:5]])
    if options.publish:
        columns = (
            "model",
            "stream",
            "of it surface",
            "every chart placed at",
            *(f"{n // 1000} kB" for n in SIZES),
        )
        command = "python -m benchmarks.prefixes --mesh FILE … -o OUT --publish"
        note = "PSNR in dB of all texels against those of the complete stream; bytes after the surface."
        write_table("prefixes", columns, rows, command=command, note=note)
    with (options.out / "prefixes.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("model", "bytes after the surface", "dB"))
        writer.writerows((name, n, f"{psnr:.2f}") for name, curve in curves.items() for n, psnr in curve)
    write_image(options.out / "prefixes.png", _plot(curves))
    write_image(options.out / "prefixes.jpg", np.vstack([np.hstack(row) for row in pictures]))
    return 0


def _streams(folder: Path, meshes: list[Path]) -> dict[str, Path]:
    # Those that are there already are measured as they are.
    ring = {"sample_size": 5.0, "direction": "around:z"}
    cases: dict[str, tuple[Path, str | Path, dict[str, Any]]] = {
        "ring": (EXEMPLAR, "cyclide", {**ring, "texels": 4_000_000}),
        "pebbles": (EXAMPLES / "pebbles.png", "cyclide", {"sample_size": 5.0, "texels": 1_000_000}),
        "chair": (EXAMPLES / "weave.png", EXAMPLES / "chair.glb", {}),
        **{mesh.stem: (EXEMPLAR, mesh, {}) for mesh in meshes},
    }
    made = {name: folder / f"prefixes-{name}.uph" for name in cases}
    for name, (sample, on, synthesis) in cases.items():
        if not made[name].exists():
            cover(sample, on, made[name], synthesis=synthesis, seed=3)
    return made


def _surface_bytes(data: bytes) -> int:
    # A mesh takes many bytes before there is anything to lay texture on.
    decoder = StreamDecoder()
    decoder.feed(data)
    return next(chunk.payload_offset + chunk.length + 4 for chunk in decoder.chunks if chunk.tag == "S")


def _picture(path: Path, most: int, folder: Path) -> PixelArray:
    picture = folder / "prefixes-part.png"
    options = WriteOptions(size=(SIDE, SIDE), view=VIEW)
    refine(path, picture, limit=Limit(most_bytes=most), options=options)
    found = read_image(picture)
    picture.unlink()
    return found


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
        if not decoder.needed:
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


def _plot(curves: dict[str, Curve]) -> PixelArray:
    width, height, left, right, top, bottom = 760, 480, 60, 20, 20, 60
    drawing = Drawing(width, height)
    low, high, first, last = 10, 45, np.log2(500), np.log2(64_000)

    def at(length: float, psnr: float) -> tuple[float, float]:
        x = left + (np.log2(length) - first) / (last - first) * (width - left - right)
        return float(x), top + (high - psnr) / (high - low) * (height - top - bottom)

    grey = (0.85, 0.85, 0.85)
    for psnr in range(low, high + 1, 5):
        drawing.lines([at(500, psnr), at(64_000, psnr)], color=grey)
        drawing.text(left - 20, int(at(500, psnr)[1]) + 5, f"{psnr}", size=14)
    for length in (500, *SIZES, 64_000):
        drawing.lines([at(length, low), at(length, high)], color=grey)
        drawing.text(int(at(length, low)[0]), height - bottom + 20, f"{length / 1000:g} kB", size=14)
    for n, ((name, curve), color) in enumerate(zip(curves.items(), COLORS, strict=False)):
        inside = [at(length, psnr) for length, psnr in curve if length <= 64_000 and psnr <= high]
        drawing.lines(inside, color=color, width=3)
        drawing.text(left + 60, top + 30 + 22 * n, name, color=color)
    drawing.text(width // 2, height - 12, "bytes after the surface; PSNR of all texels, in dB", size=14)
    return drawing.pixels()


if __name__ == "__main__":
    sys.exit(main())
