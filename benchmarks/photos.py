"""Photos of walls, tilted and vignetted, made samples again: how near they come to what they were made from.

``python -m benchmarks photos [FOLDER …] [-o OUT] [--megapixels N]``, by default of the project's examples.
A camera made here looks at each exemplar as at a piece of wall; the wall goes on round it. Its photo gets a
lens' vignette, a lamp's slope, and becomes a JPEG. `upholster prepare` gets the four corners. OUT gets a
sheet of photo, rectified, evened, original.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.ndimage import map_coordinates

from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.measure import Results
from upholster.image import (
    IMAGE_SUFFIXES,
    from_linear,
    read_exemplar,
    read_image,
    resize_image,
    to_linear,
    write_image,
)
from upholster.image.rectify import Corners, Rectification
from upholster.options import SampleOptions
from upholster.photos import prepare_sample
from upholster.types import FloatArray, PixelArray

__all__ = ["main", "photos", "take_photo"]

EXAMPLES = Path(__file__).parent.parent / "examples"
CELLS = 16
FOCAL = 0.75
"""Focal length in widths of the photo, as of most phones; the program assumes 0.72 where it cannot tell."""


@dataclass(frozen=True)
class Shot:
    """Figures of one photo.

    Attributes
    ----------
    ratio
        Width over height of what was found, of what it is: 1 is right.
    rectified
        PSNR in dB of the sample from a photo that is evenly lit; `lit` and `evened`: with the light on it, as
        it is and evened. Overall brightness is not counted.
    slope_before, slope_after
        Root mean square of the logarithm of the light on the sample, before and after.
    changed
        The same of what is done to the sample whose photo is evenly lit: 0 is right.
    seconds
        Of preparing, files included.
    """

    name: str
    ratio: float
    rectified: float
    lit: float
    evened: float
    slope_before: float
    slope_after: float
    changed: float
    seconds: float


def photos(results: Results) -> None:
    """Add means and worst figures of the project's examples."""
    shots = _measure_all([EXAMPLES], megapixels=3.0, out=None)
    for name, worst in (("rectified", min), ("lit", min), ("evened", min)):
        values = [getattr(shot, name) for shot in shots]
        results.add(
            f"photos, {name}: mean PSNR", float(np.mean(values)), "dB", remark=f"worst {worst(values):.1f}"
        )
    for name in ("slope_before", "slope_after", "changed"):
        values = [getattr(shot, name) for shot in shots]
        results.add(f"photos, {name}: mean", float(np.mean(values)), "", remark=f"worst {max(values):.3f}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks photos", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--megapixels", type=float, default=3.0)
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    shots = _measure_all([folder.resolve() for folder in asked.folders], asked.megapixels, asked.out)
    names = ("ratio", "rectified", "lit", "evened", "slope_before", "slope_after", "changed", "seconds")
    table = Table("photo", *names)
    for shot in shots:
        table.add_row(shot.name, *(f"{getattr(shot, name):.3g}" for name in names))
    table.add_row("mean", *(f"{np.mean([getattr(shot, name) for shot in shots]):.3g}" for name in names))
    Console(width=140).print(table)
    return 0


def _measure_all(folders: Sequence[Path], megapixels: float, out: Path | None) -> list[Shot]:
    shots: list[Shot] = []
    tiles: list[Tile] = []
    width = round(float(np.sqrt(megapixels * 1e6 * 4 / 3)))
    files = [file for folder in folders for file in sorted(folder.iterdir()) if file.suffix in IMAGE_SUFFIXES]
    for n, path in enumerate(files):
        original = read_exemplar(path)[:, :, :3]
        shot, pictures = _shoot(path.stem, original, n, width)
        shots.append(shot)
        tiles += pictures
    if out is not None:
        write_sheet(out / "photos.png", tiles, columns=4)
    return shots


def _shoot(name: str, original: PixelArray, n: int, width: int) -> tuple[Shot, list[Tile]]:
    """Make photos of one exemplar, prepare them, and compare."""
    height = width * 3 // 4
    rng = np.random.default_rng(n)
    pan, tilt, roll = rng.uniform((8, 8, -5), (28, 22, 5)) * rng.choice([-1, 1], 3)
    corners = _seen(original.shape[1] / original.shape[0], (pan, tilt, roll), width, height)
    found = Rectification(corners, width, height)
    wall = _wall(original, corners, width, height)
    light = _light(width, height, rng)
    side = max(original.shape[:2])
    size = f"{original.shape[1]}x{original.shape[0]}"
    samples = {}
    with tempfile.TemporaryDirectory() as folder:
        for lit in (False, True):
            photo = Path(folder, f"photo{lit}.jpg")
            write_image(photo, from_linear(wall * light if lit else wall, np.uint8), quality=93)
            for even in (False, True):
                options = SampleOptions(rectify=corners, resize=size, even_light=even)
                start = time.perf_counter()
                prepare_sample(photo, Path(folder, "sample.png"), options)
                seconds = time.perf_counter() - start
                samples[lit, even] = read_image(Path(folder, "sample.png"))
        shown = resize_image(read_image(photo), height=192, width=256)
    shot = Shot(
        name,
        found.width / found.height * original.shape[0] / original.shape[1],
        _psnr(samples[False, False], original),
        _psnr(samples[True, False], original),
        _psnr(samples[True, True], original),
        _slope(samples[True, False], original),
        _slope(samples[True, True], original),
        _slope(samples[False, True], samples[False, False]),
        seconds,
    )
    captions = (
        (name[:30], f"pan {pan:.0f}, tilt {tilt:.0f}, roll {roll:.0f} degrees"),
        ("rectified", f"{shot.lit:.1f} dB, slope {shot.slope_before:.3f}"),
        ("and evened", f"{shot.evened:.1f} dB, slope {shot.slope_after:.3f}"),
        ("original", f"evenly lit: {shot.rectified:.1f} dB, changed {shot.changed:.3f}"),
    )
    small = [_within(image, side) for image in (samples[True, False], samples[True, True], original)]
    return shot, list(zip([shown, *small], captions, strict=True))


def take_photo(
    original: PixelArray, angles: tuple[float, float, float], width: int, rng: np.random.Generator
) -> PixelArray:
    """Return a lit photo, four to three, of a wall of an exemplar: 8-bit RGB.

    `angles` are pan, tilt and roll of the camera in degrees; `width` is in pixels.
    """
    height = width * 3 // 4
    corners = _seen(original.shape[1] / original.shape[0], angles, width, height)
    light = _light(width, height, rng)
    photo: PixelArray = from_linear(_wall(original, corners, width, height) * light, np.uint8)
    return photo


def _within(image: PixelArray, side: int) -> PixelArray:
    scale = min(1.0, 256 / side)
    return resize_image(image, height=round(image.shape[0] * scale), width=round(image.shape[1] * scale))


def _seen(ratio: float, angles: tuple[float, float, float], width: int, height: int) -> Corners:
    """Return where a camera sees the corners of a piece of wall, filling most of the photo's height."""
    a, b, c = np.radians(angles)
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    corners = np.array([(-ratio, -1, 0), (ratio, -1, 0), (ratio, 1, 0), (-ratio, 1, 0)])
    turned = corners @ (about_z @ about_x @ about_y).T
    for away in np.arange(2.0, 12.0, 0.1):
        points = turned + np.array([0.0, 0.0, away])
        places = FOCAL * width * points[:, :2] / points[:, 2:] + [width / 2, height / 2]
        if (places > 8).all() and (places < np.array([width, height]) - 8).all():
            first, second, third, fourth = ((float(x), float(y)) for x, y in places)
            return first, second, third, fourth
    raise ValueError("the wall does not fit the photo")


def _wall(original: PixelArray, corners: Corners, width: int, height: int) -> FloatArray:
    """Return the photo in linear light: the exemplar between its corners, mirrored on beyond them."""
    rows = []
    rectangle = [
        (0, 0),
        (original.shape[1], 0),
        (original.shape[1], original.shape[0]),
        (0, original.shape[0]),
    ]
    for (x, y), (u, v) in zip(corners, rectangle, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, -u], [0, 0, 0, x, y, 1, -v * x, -v * y, -v]]
    matrix = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    # Where the photo has fewer pixels than the exemplar, several points are averaged.
    linear = to_linear(original).astype(np.float64)
    photo = np.zeros((height, width, linear.shape[2]))
    for down, across in ((0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)):
        x, y = np.meshgrid(np.arange(width) + across, np.arange(height) + down)
        u, v, w = np.moveaxis(np.stack([x, y, np.ones_like(x)], axis=-1) @ matrix.T, -1, 0)
        places = np.stack([v / w - 0.5, u / w - 0.5])
        for channel in range(linear.shape[2]):
            photo[:, :, channel] += (
                map_coordinates(linear[:, :, channel], places, order=1, mode="reflect") / 4
            )
    return photo


def _light(width: int, height: int, rng: np.random.Generator) -> FloatArray:
    """Return what a lens and a lamp do: cos⁴ of the angle from the axis, and a slope to a random side."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / width - 0.5)
    vignette = 1 / (1 + (x**2 + y**2) / FOCAL**2) ** 2
    angle = rng.uniform(0, 2 * np.pi)
    slope = np.exp(0.8 * (x * np.cos(angle) + y * np.sin(angle)))
    light: FloatArray = (vignette * slope / (vignette * slope).max())[:, :, None]
    return light


def _psnr(sample: PixelArray, original: PixelArray) -> float:
    """Return the PSNR of sRGB codes, mean light made equal."""
    linear = to_linear(sample)
    equal = from_linear(linear * (to_linear(original).mean() / linear.mean()), np.uint8)
    error = float(np.mean((equal.astype(float) - original) ** 2))
    return float(10 * np.log10(255**2 / error))


def _slope(sample: PixelArray, original: PixelArray) -> float:
    """Return the root mean square of the logarithm of the light, over cells of the sample."""
    means = [
        resize_image(to_linear(image), height=CELLS, width=CELLS).mean(axis=2) for image in (sample, original)
    ]
    return float(np.log(means[0] / means[1]).std())
