"""First hours: photos and surfaces with no option at all, as somebody begins.

``python -m benchmarks first_hours [-o OUT]``. Twelve photos: the project's seven samples; made here, two
taken aslant, two lit unevenly, and one of twelve megapixels. Six surfaces. Each pair is one command,
``upholster cover PHOTO --on SURFACE -o PICTURE``, in a process of its own. OUT gets a sheet of all pictures.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.measure import Results
from benchmarks.photos import EXAMPLES, take_photo
from upholster.geometry import surface_from_spec
from upholster.image import read_exemplar, read_image, resize_image, write_image
from upholster.types import PixelArray

__all__ = ["first_hours", "main"]

SURFACES = ("torus", "cyclide", "vase", "sphere", "cone", "box")
SHARE = 6
"""The sample is a sixth of the model wide."""

BOX = (
    *(((0, 0, 1), (1, 0, 0), (0, 0, -1)), ((1, 0, 1), (0, 1, 0), (0, 0, -1))),
    *(((1, 1, 1), (-1, 0, 0), (0, 0, -1)), ((0, 1, 1), (0, -1, 0), (0, 0, -1))),
    *(((0, 1, 1), (1, 0, 0), (0, -1, 0)), ((0, 0, 0), (1, 0, 0), (0, 1, 0))),
)
"""Six squares: a corner, the step to the right, the step down."""


@dataclass(frozen=True)
class Hour:
    """What came of one pair: width of the sample over a sixth of the model, seconds, and bytes of memory."""

    share: float
    seconds: float
    memory: int


def first_hours(results: Results, out: Path | None = None) -> None:
    """Cover every surface with every photo; add the worst figures, and write the sheet."""
    hours: list[Hour] = []
    tiles: list[Tile] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        corners = [np.array(face, float) for face in BOX]
        nets = [[[o, o + right], [o + down, o + right + down]] for o, right, down in corners]
        written = json.dumps({"patches": [{"points": np.array(net).tolist()} for net in nets]})
        (folder / "box.json").write_text(written)
        for photo in _photos(folder):
            for surface in SURFACES:
                on = str(folder / "box.json") if surface == "box" else surface
                hour, tile = _hour(photo, on, folder)
                hours.append(hour)
                tiles.append((tile, (f"{photo.stem} on {surface}", f"{hour.seconds:.1f} s")))
                print(f"{photo.stem} on {surface}: {hour}", file=sys.stderr, flush=True)
    apart = max(abs(hour.share - 1) for hour in hours)
    results.add("first hours: pairs", len(hours), "")
    results.add("first hours: sample's width off the rule, worst", 100 * apart, "%", aim="0")
    results.add("first hours: longest", max(hour.seconds for hour in hours), "s", aim="at most 60")
    most = max(hour.memory for hour in hours) / 1e9
    results.add("first hours: most memory", most, "GB", aim="at most 1.5")
    if out is not None:
        write_sheet(out, tiles, columns=len(SURFACES))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks first_hours", description=__doc__)
    parser.add_argument("-o", dest="out", type=Path, metavar="OUT", help="sheet of all pictures, PNG")
    asked = parser.parse_args(arguments)
    results = Results()
    first_hours(results, asked.out)
    results.show()
    return 0


def _photos(folder: Path) -> Iterator[Path]:
    """Make the photos, one by one, and yield their files."""
    for name in ("bricks", "brick", "pebbles", "granite", "grass", "gravel", "weave"):
        yield EXAMPLES / f"{name}.png"
    rng = np.random.default_rng(5)
    for kind, name, angles, width in (
        ("aslant", "bricks", (24.0, -12.0, 3.0), 1600),
        ("aslant", "pebbles", (-18.0, 15.0, -4.0), 1600),
        ("lit", "weave", (0.0, 0.0, 0.0), 1200),
        ("lit", "granite", (0.0, 0.0, 0.0), 1200),
        ("large", "gravel", (6.0, 4.0, 1.0), 4000),
    ):
        path = folder / f"{kind}_{name}.jpg"
        write_image(path, take_photo(_rgb(name), angles, width, rng), quality=93)
        yield path


def _rgb(name: str) -> PixelArray:
    pixels = read_exemplar(EXAMPLES / f"{name}.png")
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[:, :, :3]


def _hour(photo: Path, on: str, folder: Path) -> tuple[Hour, PixelArray]:
    picture, report = folder / "picture.png", folder / "report.json"
    command = [sys.executable, "-m", "upholster", "cover", str(photo), "--on", on]
    subprocess.run([*command, "-q", "-o", str(picture), "--report", str(report)], check=True)
    found = json.loads(report.read_text())
    width = float(found["settled"]["sample"].split()[0])
    rule = surface_from_spec(on).size / SHARE
    hour = Hour(round(width / rule, 3), found["seconds"]["total"], found["peak_memory_bytes"] or 0)
    return hour, resize_image(read_image(picture), height=192, width=256)


if __name__ == "__main__":
    sys.exit(main())
