"""Holes in photographs, filled by ours and its peers: time, border, and pictures to look at.

``python -m benchmarks fill FOLDER … [-o OUT] [--only NAME …] [--publish]``, by default of the project's
examples. Each image gets a box, a circle, a scratch and a window's frame; what is not installed is left out
with a message. OUT gets a sheet of photo with hole and what each made of it.

The border is the mean difference between neighbours across it, over that of the photo as it was: 1 is right.
A filling that is right need not be what was there, so nothing is compared pixel by pixel.
"""

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity_methods import versions
from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.measure import EXEMPLAR, Results
from benchmarks.tables import write_table
from upholster.image import IMAGE_SUFFIXES, read_image, write_image
from upholster.measure import measure_image
from upholster.types import PixelArray

__all__ = ["fill", "main"]

EXAMPLES = EXEMPLAR.parent
LIMIT = 120.0
"""Seconds that a peer may take."""

AROUND = 16
"""Pixels round a hole that its texture is compared with the rest in."""

Mask = NDArray[np.bool_]
Filler = Callable[[PixelArray, Mask], PixelArray]

_RESYNTHESIZE = """
import sys
import resynthesizer
from PIL import Image
parameters = resynthesizer.getDefaultParams()
parameters.isMakeSeamlesslyTileableHorizontally = parameters.isMakeSeamlesslyTileableVertically = 0
photo, mask = Image.open(sys.argv[1]).convert("RGB"), Image.open(sys.argv[2]).convert("L")
resynthesizer.resynthesize(photo, mask, parameters).save(sys.argv[3])
"""


@dataclass(frozen=True)
class Filled:
    """Figures of one hole.

    Attributes
    ----------
    seconds
        Of peers with starting their program and its files.
    border
        See above.
    wasserstein
        Sliced Wasserstein distance of the hole's surroundings from the photo as it was.
    """

    seconds: float
    border: float
    wasserstein: float


def fill(results: Results) -> None:
    """Add medians over the project's examples."""
    for name, found in _measure_all([EXAMPLES], None, None).items():
        for figure, unit in (("seconds", "s"), ("border", "")):
            median = float(np.median([getattr(one, figure) for one in found]))
            results.add(f"fill, {name}: {figure}", median, unit, remark=f"median of {len(found)} holes")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks fill", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--only", nargs="*", help="images whose names begin so")
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    columns = ("program", "seconds", "at worst", "border", "farthest from 1", "Wasserstein distance")
    rows, most = [], 0
    for name, found in _measure_all(asked.folders, asked.out, asked.only).items():
        seconds, borders = [one.seconds for one in found], [one.border for one in found]
        figures = (
            np.median(seconds),
            max(seconds),
            np.median(borders),
            max(borders, key=lambda border: abs(np.log(border))),
            np.median([one.wasserstein for one in found]),
        )
        rows.append([name, *(f"{figure:.2g}" for figure in figures)])
        most = max(most, len(found))
    if asked.publish:
        command, note = (
            "python -m benchmarks fill FOLDER --publish",
            f"Seconds by the clock. Medians of {most} holes.",
        )
        write_table(
            "fill", columns, rows, command=command, peers=versions("G'MIC", "resynthesizer"), note=note
        )
    table = Table(*columns)
    for row in rows:
        table.add_row(*row)
    Console(width=140).print(table)
    return 0


def _measure_all(
    folders: Sequence[Path], out: Path | None, only: Sequence[str] | None
) -> dict[str, list[Filled]]:
    fillers = _fillers()
    found: dict[str, list[Filled]] = defaultdict(list)
    files = [file for folder in folders for file in sorted(folder.iterdir()) if file.suffix in IMAGE_SUFFIXES]
    for path in files:
        if only and not path.name.startswith(tuple(only)):
            continue
        photo, tiles = read_image(path)[:, :, :3], list[Tile]()
        for kind, hole in _holes(*photo.shape[:2]).items():
            given = photo.copy()
            given[hole] = np.iinfo(photo.dtype).max
            tiles.append((given, [path.stem[:40], kind]))
            for name, filler in fillers.items():
                start = time.perf_counter()
                try:
                    made = filler(given, hole)
                except subprocess.TimeoutExpired:
                    print(f"{name} took more than {LIMIT:.0f} s: {path.stem}, {kind}", file=sys.stderr)
                    tiles.append((given, [name, "too long"]))
                    continue
                one = _judged(made, photo, hole, time.perf_counter() - start)
                found[name].append(one)
                tiles.append((made, [name, f"{one.seconds:.1f} s, border {one.border:.2f}"]))
        if out is not None:
            write_sheet(out / f"fill_{path.stem}.png", tiles, columns=1 + len(fillers))
    return found


def _judged(made: PixelArray, photo: PixelArray, hole: Mask, seconds: float) -> Filled:
    borders = []
    for image in (made, photo):
        across = [
            np.abs(np.diff(image.astype(float), axis=axis)).mean(axis=2)[np.diff(hole, axis=axis)]
            for axis in (0, 1)
        ]
        borders.append(float(np.concatenate(across).mean()))
    rows, columns = (np.flatnonzero(hole.any(axis=axis)) for axis in (1, 0))
    window = tuple(slice(max(0, at[0] - AROUND), at[-1] + 1 + AROUND) for at in (rows, columns))
    compared = measure_image(np.ascontiguousarray(made[window]), photo)
    return Filled(seconds, borders[0] / borders[1], compared.wasserstein_mean)


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


def _fillers() -> dict[str, Filler]:
    found: dict[str, Filler] = {"upholster": _ours}
    _ours(np.full((64, 64, 3), 128, np.uint8), np.indices((64, 64))[0] > 60)  # kernels are loaded
    if importlib.util.find_spec("resynthesizer"):
        found["resynthesizer"] = _resynthesizer
    else:
        print("resynthesizer is not installed (extra `fidelity`)", file=sys.stderr)
    if shutil.which("gmic"):
        # By patches of 11 pixels, as its graphical filter begins; without numbers it only spreads colours.
        found["G'MIC inpaint"] = lambda photo, hole: _gmic(
            photo, hole, "inpaint", "11,22,0.5,1,9,0,0.05,10,1"
        )
        found["G'MIC matchpatch"] = lambda photo, hole: _gmic(photo, hole, "inpaint_matchpatch")
    else:
        print("the program gmic is not installed", file=sys.stderr)
    return found


def _ours(photo: PixelArray, hole: Mask) -> PixelArray:
    found = upholster.fill(photo, hole)
    assert isinstance(found, np.ndarray)
    return found


def _resynthesizer(photo: PixelArray, hole: Mask) -> PixelArray:
    return _by_files(photo, hole, lambda *names: [sys.executable, "-c", _RESYNTHESIZE, *names])


def _gmic(photo: PixelArray, hole: Mask, command: str, numbers: str = "") -> PixelArray:
    mask_and = ",".join(filter(None, ("[1]", numbers)))
    return _by_files(
        photo,
        hole,
        lambda given, mask, out: ["gmic", "-v", "-", given, mask, f"{command}[0]", mask_and, "-o[0]", out],
    )


def _by_files(photo: PixelArray, hole: Mask, command: Callable[[str, str, str], list[str]]) -> PixelArray:
    """Run a program on a photo's file and a mask's, white in the hole; return what it wrote."""
    with tempfile.TemporaryDirectory() as folder:
        names = f"{folder}/photo.png", f"{folder}/mask.png", f"{folder}/out.png"
        write_image(names[0], photo)
        write_image(names[1], np.where(hole, 255, 0).astype(np.uint8)[:, :, None])
        subprocess.run(command(*names), check=True, capture_output=True, timeout=LIMIT)
        found = read_image(names[2])[:, :, : photo.shape[2]]
    return np.ascontiguousarray(found)
