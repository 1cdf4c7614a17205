"""Generated samples of regular textures, never exactly periodic: walls, tiles, weaves.

Each is a pattern of elements, of which every pixel has one: elements differ in colour, their joints in width,
and the whole is displaced by smooth noise of about a pixel. The same seed gives the same pixels.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray

__all__ = ["PATTERNS", "Elements", "LatticeSample", "lattice_sample"]

Image = NDArray[np.uint8]
Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Elements:
    """Which element each place belongs to.

    Attributes
    ----------
    number
        (H, W) int64: one number for each element.
    depth
        (H, W): distance from the border of the element, in pixels, 0 and more.
    kind
        (H, W): 0 or 1, for patterns of two colours or directions.
    """

    number: Numbers
    depth: FloatArray
    kind: Numbers


@dataclass(frozen=True, eq=False)
class LatticeSample:
    """A generated sample, and what is known of it.

    Attributes
    ----------
    image
        (side, side, 3) uint8.
    waves
        (2, 2) a basis of the waves that the pattern consists of: cycles per pixel, rows and columns.
    """

    image: Image
    waves: FloatArray


def _boxes(row: FloatArray, column: FloatArray, height: float, width: float) -> tuple[Numbers, ...]:
    return np.floor(row / height).astype(np.int64), np.floor(column / width).astype(np.int64)


def _depth(row: FloatArray, column: FloatArray, height: float, width: float) -> FloatArray:
    # Distance from the border of the box that holds a place.
    down, right = row % height, column % width
    nearest: FloatArray = np.minimum(np.minimum(down, height - down), np.minimum(right, width - right))
    return nearest


def _joined(i: Numbers, j: Numbers) -> Numbers:
    return i * 4099 + j


def running_bond(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Bricks of 1 × 2 units, every second course moved by half a brick."""
    course = np.floor(row / unit).astype(np.int64)
    moved = column + unit * (course % 2)
    i, j = _boxes(row, moved, unit, 2 * unit)
    return Elements(_joined(i, j), _depth(row, moved, unit, 2 * unit), np.zeros_like(i))


def stack_bond(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Tiles of 1 × 1.5 units, one exactly above the other."""
    i, j = _boxes(row, column, unit, 1.5 * unit)
    return Elements(_joined(i, j), _depth(row, column, unit, 1.5 * unit), np.zeros_like(i))


def hexagons(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Regular hexagons, 1 unit from side to side."""
    height = unit * np.sqrt(3) / 2
    near: list[tuple[FloatArray, Numbers]] = []
    for step in (-1, 0, 1, 2):
        i = np.floor(row / height).astype(np.int64) + step
        for beside in (0, 1):
            j = np.floor(column / unit - 0.5 * (i % 2)).astype(np.int64) + beside
            away = np.hypot(row - i * height, column - (j + 0.5 * (i % 2)) * unit)
            near.append((away, _joined(i, j)))
    away = np.stack([entry[0] for entry in near])
    order = np.argsort(away, axis=0, kind="stable")
    ranked = np.take_along_axis(away, order[:2], axis=0)
    number = np.take_along_axis(np.stack([entry[1] for entry in near]), order[:1], axis=0)[0]
    # The border is where two centres are equally far, 1 unit apart.
    depth = (ranked[1] ** 2 - ranked[0] ** 2) / (2 * unit)
    return Elements(number, depth, np.zeros_like(number))


def herringbone(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Bricks of 1 × 2 units, lying and standing by turns along diagonals."""
    i, j = _boxes(row, column, unit, unit)
    place = (j - i) % 4
    lying = place < 2
    # The box of the brick: its upper left unit.
    top, left = i - (place == 2), j - (place == 1)
    down, right = row - top * unit, column - left * unit
    height, width = np.where(lying, unit, 2 * unit), np.where(lying, 2 * unit, unit)
    depth = np.minimum(np.minimum(down, height - down), np.minimum(right, width - right))
    return Elements(_joined(top, left), depth, lying.astype(np.int64))


def basket_weave(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Pairs of bricks of 1 × 2 units, lying and standing by turns as on a chessboard."""
    i, j = _boxes(row, column, 2 * unit, 2 * unit)
    lying = (i + j) % 2 == 0
    height, width = np.where(lying, unit, 2 * unit), np.where(lying, 2 * unit, unit)
    top, left = np.floor(row / height).astype(np.int64), np.floor(column / width).astype(np.int64)
    down, right = row - top * height, column - left * width
    depth = np.minimum(np.minimum(down, height - down), np.minimum(right, width - right))
    return Elements(2 * _joined(top, left) + lying, depth, lying.astype(np.int64))


def gingham(row: FloatArray, column: FloatArray, unit: float) -> Elements:
    """Coloured and plain stripes of 1 unit, crossing; where both are coloured it is darkest."""
    i, j = _boxes(row, column, unit, unit)
    kind = (i % 2) + (j % 2)
    return Elements(_joined(i, j), np.full(row.shape, unit), kind)


Pattern = Callable[[FloatArray, FloatArray, float], Elements]

PATTERNS: dict[str, tuple[Pattern, tuple[tuple[float, float], tuple[float, float]]]] = {
    "running_bond": (running_bond, ((1.0, 0.0), (0.5, 0.5))),
    "stack_bond": (stack_bond, ((1.0, 0.0), (0.0, 2 / 3))),
    "hexagons": (hexagons, ((2 / np.sqrt(3), 0.0), (1 / np.sqrt(3), 1.0))),
    "herringbone": (herringbone, ((1.0, 0.0), (-0.25, 0.25))),
    "basket_weave": (basket_weave, ((0.25, 0.25), (0.25, -0.25))),
    "gingham": (gingham, ((0.5, 0.0), (0.0, 0.5))),
}
"""Each pattern, and a basis of its waves in cycles per unit."""

_COLORS = {
    "running_bond": ((150, 74, 52), (150, 74, 52), (190, 182, 170)),
    "stack_bond": ((62, 96, 104), (62, 96, 104), (188, 190, 186)),
    "hexagons": ((196, 184, 160), (196, 184, 160), (92, 84, 74)),
    "herringbone": ((138, 92, 56), (138, 92, 56), (72, 60, 50)),
    "basket_weave": ((168, 120, 84), (168, 120, 84), (96, 88, 80)),
    "gingham": ((236, 232, 222), (170, 30, 44), (0, 0, 0)),
}
"""Of elements of kinds 0 and 1, and of the joints between them."""


def lattice_sample(
    pattern: str, *, side: int = 256, unit: float = 24.0, angle: float = 0.0, seed: int = 1
) -> LatticeSample:
    """Return a generated sample.

    Parameters
    ----------
    pattern
        One of `PATTERNS`.
    side
        Of the image, in pixels.
    unit
        Length of a unit of the pattern, in pixels: the height of a course, or the width of a brick.
    angle
        By which the pattern is turned clockwise, in degrees.
    seed
        Of everything random: displacement, colours, joints, grain.
    """
    rng = np.random.default_rng([seed, sorted(PATTERNS).index(pattern)])
    draw, basis = PATTERNS[pattern]
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    rows, columns = np.mgrid[0:side, 0:side].astype(np.float64)
    rows += 0.03 * unit * _noise(rng, side, 1.5, unit)
    columns += 0.03 * unit * _noise(rng, side, 1.5, unit)
    start = rng.uniform(0, 8 * unit, 2)
    turned = cosine * rows - sine * columns + start[0], sine * rows + cosine * columns + start[1]
    elements = draw(*turned, unit)
    _, number = np.unique(elements.number, return_inverse=True)
    number = number.reshape(side, side)
    count = int(number.max()) + 1
    tone = 1 + 0.13 * np.clip(rng.normal(size=count), -2, 2)[number]
    tint = 1 + 0.03 * rng.normal(size=(count, 3))[number]
    joint = unit * (0.06 + 0.015 * rng.normal(size=count).clip(-2, 2)[number])
    colors = np.array(_COLORS[pattern], np.float64)
    if pattern == "gingham":
        share = np.array([0.0, 0.5, 1.0])[elements.kind][:, :, None]
        plain = colors[0] + (colors[1] - colors[0]) * share
        tone, tint = 1 + 0.2 * (tone - 1), np.ones((side, side, 1))
        fine = np.where((np.floor(turned[0] / 2) + np.floor(turned[1] / 2)) % 2 == 0, 1.03, 0.97)
        image = plain * (tone * fine)[:, :, None] * tint
    else:
        solid = np.clip(elements.depth - joint + 0.5, 0, 1)[:, :, None]
        image = colors[2] + (colors[0] * tone[:, :, None] * tint - colors[2]) * solid
    grain = 1 + 0.04 * _noise(rng, side, 0.8, 2.0)
    image = image * grain[:, :, None]
    waves = np.array(basis) / unit
    # f·(turned place) = (turned f)·place.
    waves = np.stack(
        [cosine * waves[:, 0] + sine * waves[:, 1], cosine * waves[:, 1] - sine * waves[:, 0]], axis=1
    )
    return LatticeSample(np.rint(np.clip(image, 0, 255)).astype(np.uint8), waves)


def _noise(rng: np.random.Generator, side: int, power: float, low: float) -> FloatArray:
    # Noise whose amplitude falls as frequency^-power beyond a period of `low` pixels; mean 0, deviation 1.
    frequency = np.fft.fftfreq(2 * side)
    radius = np.hypot(frequency[:, None], frequency[None, :])
    spectrum = np.fft.fft2(rng.normal(size=(2 * side, 2 * side))) * np.maximum(radius, 0.25 / low) ** -power
    spectrum[0, 0] = 0
    field: FloatArray = np.fft.ifft2(spectrum).real[:side, :side]
    return np.asarray(field / field.std())
