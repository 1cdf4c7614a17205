"""Holes in photographs, filled by ours and its peers: time, border, and pictures to look at.

Each image gets a box, a circle, a scratch and a window's frame; what is not installed is left out with a
message. With ``-o`` there is a sheet of each photo with its holes and what each program made of them.

The border is the mean difference between neighbours across it, over that of the photo as it was: 1 is right.
A filling that is right need not be what was there, so nothing is compared pixel by pixel.
"""

import subprocess
import sys
import time
from collections import defaultdict

import numpy as np

from benchmarks.contact_sheet import Tile, write_sheet
from benchmarks.measure import EXAMPLES, Request
from benchmarks.peers import LIMIT, Filler, Mask, fillers, versions
from benchmarks.tables import Table
from upholster.base.types import PixelArray
from upholster.covering.measure import sliced_wasserstein
from upholster.image.files.read import read_image
from upholster.image.files.write import IMAGE_SUFFIXES

__all__ = ["measured"]

AROUND = 16
"""Pixels round a hole that its texture is compared with the rest in."""

Figures = tuple[float, float, float]
"""Seconds, of peers with starting their program and its files; border; sliced Wasserstein distance."""


def measured(request: Request) -> Table:
    """Return medians over all holes, and the worst."""
    programs = fillers()
    found: dict[str, list[Figures]] = defaultdict(list)
    for path in (request if request.files else Request((EXAMPLES,))).listed(IMAGE_SUFFIXES):
        photo, tiles = read_image(path)[:, :, :3], list[Tile]()
        for kind, hole in _holes(*photo.shape[:2]).items():
            given = photo.copy()
            given[hole] = np.iinfo(photo.dtype).max
            tiles.append((given, [path.stem[:40], kind]))
            for name, filler in programs.items():
                made, figures = _filled(filler, given, photo, hole)
                if figures is None:
                    print(f"{name} took more than {LIMIT:.0f} s: {path.stem}, {kind}", file=sys.stderr)
                else:
                    found[name].append(figures)
                    print(path.stem, kind, name, *(f"{figure:.2g}" for figure in figures), file=sys.stderr)
                said = "too long" if figures is None else f"{figures[0]:.1f} s, border {figures[1]:.2f}"
                tiles.append((made, [name.strip("`"), said]))
        if request.out is not None:
            write_sheet(request.out / f"fill_{path.stem}.png", tiles, columns=1 + len(programs))
    rows = []
    for name, own in found.items():
        seconds, borders, distances = zip(*own, strict=True)
        worst = max(borders, key=lambda border: abs(np.log(border)))
        figures_of = (np.median(seconds), max(seconds), np.median(borders), worst)
        shown = [f"{figure:.3g}" if figure > 1 else f"{figure:.2g}" for figure in figures_of]
        rows.append([name, *shown, f"{np.median(distances):.4f}"])
    note = f"Seconds by the clock. Medians of {max(map(len, found.values()))} holes. "
    note += "Border: difference across the hole's edge over that of the photo; 1 is right."
    columns = ("program", "seconds", "at worst", "border", "farthest from 1", "Wasserstein distance")
    return Table(columns, rows, {"peers": versions("G'MIC", "resynthesizer"), "note": note})


def _filled(
    filler: Filler, given: PixelArray, photo: PixelArray, hole: Mask
) -> tuple[PixelArray, Figures | None]:
    start = time.perf_counter()
    try:
        made = filler(given, hole)
    except subprocess.TimeoutExpired:
        return given, None
    seconds = time.perf_counter() - start
    borders = []
    for image in (made, photo):
        across = [
            np.abs(np.diff(image.astype(float), axis=axis)).mean(axis=2)[np.diff(hole, axis=axis)]
            for axis in (0, 1)
        ]
        borders.append(float(np.concatenate(across).mean()))
    rows, columns = (np.flatnonzero(hole.any(axis=axis)) for axis in (1, 0))
    window = tuple(slice(max(0, at[0] - AROUND), at[-1] + 1 + AROUND) for at in (rows, columns))
    distances = sliced_wasserstein([np.ascontiguousarray(made[window])], photo)
    return made, (seconds, borders[0] / borders[1], float(np.mean(distances)))


def _holes(height: int, width: int) -> dict[str, Mask]:
    rows, columns = np.indices((height, width))
    y, x = rows / height, columns / width
    line = np.abs(y - 0.25 - 0.35 * (x - 0.1)) * height
    frame = np.maximum(np.abs(y - 0.5), np.abs(x - 0.5))
    return {
        "box": (np.abs(y - 0.42) < 0.15) & (np.abs(x - 0.55) < 0.15),
        "circle": (y - 0.5) ** 2 + (x - 0.45) ** 2 < 0.12**2,
        "scratch": (line < 5) & (np.abs(x - 0.5) < 0.4),
        "window": (frame < 0.3) & (frame > 0.24),
    }
