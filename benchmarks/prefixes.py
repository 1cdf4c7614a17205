"""What the first bytes of a stream show: ``python -m benchmarks.prefixes [--mesh FILE] [-o OUT]``.

The PSNR of all texels against those of the whole stream after 1, 2, 4, 8, 16 and 32 kB, for README's
first model, a mesh (by default the chair of the examples) and a flat texture. Writes ``prefixes.csv``, and
``prefixes.png`` with a curve each, to OUT.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from benchmarks.measure import EXEMPLAR
from upholster.image import write_image
from upholster.image.drawing import Drawing
from upholster.levels import texels_psnr
from upholster.pipeline import cover
from upholster.stream import StreamDecoder
from upholster.types import PixelArray

__all__ = ["main"]

SIZES = (1000, 2000, 4000, 8000, 16_000, 32_000)
EXAMPLES = EXEMPLAR.parent
COLORS = {"ring": (0.75, 0.25, 0.1), "mesh": (0.1, 0.35, 0.7), "flat": (0.1, 0.55, 0.2)}

Curve = list[tuple[int, float]]


def main(argv: list[str] | None = None) -> int:
    """Make the streams, measure their prefixes, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", type=Path, default=EXAMPLES / "chair.glb")
    parser.add_argument("-o", "--out", type=Path, default=Path(__file__).parent)
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    curves: dict[str, Curve] = {}
    for name, path in _streams(options.out, options.mesh).items():
        data = path.read_bytes()
        curves[name] = _curve(data)
        placed = _placed_at(data)
        at_sizes = dict(curves[name])
        row = ", ".join(f"{size // 1000} kB {at_sizes[size]:.1f}" for size in SIZES if size in at_sizes)
        print(f"{name}: {row} dB; every chart has its placements after {placed:,} bytes of {len(data):,}")
    with (options.out / "prefixes.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("model", "bytes", "dB"))
        writer.writerows((name, n, f"{psnr:.2f}") for name, curve in curves.items() for n, psnr in curve)
    write_image(options.out / "prefixes.png", _plot(curves))
    return 0


def _streams(folder: Path, mesh: Path) -> dict[str, Path]:
    # Those that are there already are measured as they are.
    made = {name: folder / f"prefixes-{name}.uph" for name in COLORS}
    ring = {"sample_size": 5.0, "direction": "around:z"}
    if not made["ring"].exists():
        cover(EXEMPLAR, "cyclide", made["ring"], synthesis={**ring, "texels": 4_000_000}, seed=3)
    if not made["mesh"].exists():
        cover(EXAMPLES / "weave.png", mesh, made["mesh"])
    if not made["flat"].exists():
        cover(EXAMPLES / "granite.png", "plane", made["flat"], synthesis={"texels": (1024, 1024)})
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
            found.append((length, texels_psnr(decoder.texels(), best)))
    return found


def _placed_at(data: bytes) -> int:
    decoder = StreamDecoder()
    for place in range(0, len(data), 16):
        decoder.feed(data[place : place + 16])
        if decoder.charts and decoder.charts_known == len(decoder.charts):
            return decoder.received
    return len(data)


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
    for n, (name, curve) in enumerate(curves.items()):
        inside = [at(length, psnr) for length, psnr in curve if length <= 64_000 and psnr <= high]
        drawing.lines(inside, color=COLORS[name], width=3)
        drawing.text(left + 60, top + 30 + 22 * n, name, color=COLORS[name])
    drawing.text(width // 2, height - 12, "bytes of the stream; PSNR of all texels, in dB", size=14)
    return drawing.pixels()


if __name__ == "__main__":
    sys.exit(main())
