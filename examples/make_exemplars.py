"""Make the colour exemplars of this folder, always the same: `python examples/make_exemplars.py [folder]`.

Each is an image of 256 × 256 pixels that repeats without a seam, seen straight on and evenly lit: height and
colour of a material are drawn from noise, and shaded by one light from the upper left. Of the bricks there is
the material as well, without any light in it: albedo, normal, roughness, ao, height. Pure NumPy.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.image.files.write import write_image

Field = NDArray[np.float64]
"""(256, 256): one number per pixel."""

SIZE = 256
ROWS, COLUMNS = np.mgrid[0:SIZE, 0:SIZE].astype(float)


def noise(rng: np.random.Generator, power: float, *, low: float = 1.0, stretch: float = 1.0) -> Field:
    """Return periodic noise whose amplitude falls as frequency^-power above `low`; mean 0, deviation 1.

    `stretch` > 1 draws it out along the rows.
    """
    frequency = np.fft.fftfreq(SIZE, 1 / SIZE)
    radius = np.hypot(frequency[:, None], frequency[None, :] * stretch)
    spectrum = np.fft.fft2(rng.normal(size=(SIZE, SIZE))) * np.maximum(radius, low) ** -power
    spectrum[0, 0] = 0
    field = np.fft.ifft2(spectrum).real
    return np.asarray(field / field.std())


def blur(field: Field, sigma: float) -> Field:
    """Smooth with a periodic Gaussian of `sigma` pixels."""
    frequency = np.fft.fftfreq(SIZE)
    kernel = np.exp(-2 * (np.pi * sigma) ** 2 * (frequency[:, None] ** 2 + frequency**2))
    return np.fft.ifft2(np.fft.fft2(field) * kernel).real


def shade(height: Field, strength: float) -> Field:
    """Return brightness about 1 of a height field lit from the upper left, with hollows darkened."""
    down = np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)
    right = np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)
    light = 1 + strength * (0.8 * down + 0.6 * right)
    hollow = np.clip(blur(height, 4) - height, 0, None)
    return np.clip(light, 0.25, 1.9) * np.exp(-0.6 * strength * hollow)


def mix(one: NDArray[np.float64], other: NDArray[np.float64], share: Field) -> NDArray[np.float64]:
    """Blend two colours, or images of colours, by a field from 0 to 1."""
    return one + (other - one) * np.clip(share, 0, 1)[:, :, None]


def smoothstep(low: float, high: float, field: Field) -> Field:
    """Go smoothly from 0 at `low` to 1 at `high`."""
    x = np.clip((field - low) / (high - low), 0, 1)
    return x * x * (3 - 2 * x)


def color(code: str) -> NDArray[np.float64]:
    """Return a colour such as ``b5523c`` as linear light."""
    coded = np.array([int(code[k : k + 2], 16) for k in (0, 2, 4)]) / 255
    return coded**2.2


def finished(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return linear light as an image."""
    return np.asarray(np.clip(linear, 0, 1) ** (1 / 2.2) * 255 + 0.5).astype(np.uint8)


class Wall(NamedTuple):
    """What a wall is made of.

    Attributes
    ----------
    color
        (256, 256, 3): linear light, evenly lit.
    height
        In pixels.
    brick
        1 on bricks, 0 on mortar.
    burnt, pits
        Where bricks are glazed by the fire, and where they are holed: 0 to 1.
    """

    color: NDArray[np.float64]
    height: Field
    brick: Field
    burnt: Field
    pits: Field


def wall(rng: np.random.Generator) -> Wall:
    """Build a wall of red bricks in running bond: eight courses, four bricks each."""
    course, length, joint = SIZE / 8, SIZE / 4, 4.2
    # Edges wander a little, so that no joint is a ruled line.
    rows = ROWS + 0.9 * noise(rng, 1.6, low=4)
    columns = COLUMNS + 0.9 * noise(rng, 1.6, low=4)
    line = np.floor(rows / course).astype(int) % 8
    shifted = columns + line % 2 * length / 2
    which = np.floor(shifted / length).astype(int) % 4
    x = shifted % length
    y = rows % course
    to_edge = np.minimum(np.minimum(x, length - x), np.minimum(y, course - y))
    corner = 3.5  # rounded: the distance to the corner's circle
    dx, dy = (corner + joint / 2 - np.minimum(a, b) for a, b in ((x, length - x), (y, course - y)))
    rounded = joint / 2 + corner - np.hypot(np.maximum(dx, 0), np.maximum(dy, 0))
    to_edge = np.where((dx > 0) & (dy > 0), np.minimum(to_edge, rounded), to_edge)
    chipped = to_edge + 0.8 * noise(rng, 0.9, low=6)
    brick = smoothstep(joint / 2 - 0.7, joint / 2 + 0.9, chipped)

    def per_brick(values: NDArray[np.float64]) -> Field:
        return np.asarray(values[line, which])

    tones = np.stack([color(code) for code in ("8f4a38", "a4553f", "7b3f35", "b06a4e", "995a48", "6e3a33")])
    clay = tones[rng.permutation(np.arange(32) % 6).reshape(8, 4)[line, which]]
    clay = clay * per_brick(rng.uniform(0.85, 1.15, (8, 4)))[:, :, None]
    burnt = smoothstep(0.2, 2.4, noise(rng, 1.2, low=3) + per_brick(rng.normal(0, 0.9, (8, 4))))
    clay = mix(clay, color("4a2f2c"), 0.55 * burnt)
    clay = mix(clay, color("c08f74"), 0.4 * smoothstep(0.9, 2.6, noise(rng, 1.3, low=5)))
    pits = smoothstep(1.6, 2.5, noise(rng, 0.55, low=30))
    grain = noise(rng, 0.5, low=16)
    mortar = mix(color("a59d90"), color("857c70"), 0.5 + 0.35 * noise(rng, 0.8, low=8))
    mortar = mortar * (1 + 0.10 * noise(rng, 0.2))[:, :, None]
    dome = np.sqrt(np.clip(chipped / 7, 0, 1))
    tilt = per_brick(rng.normal(0, 0.25, (8, 4)))
    height = brick * (2.1 + 0.5 * dome + tilt - 0.9 * pits + 0.15 * grain) + (1 - brick) * 0.18 * noise(
        rng, 0.4
    )
    surface = mix(mortar, clay * (1 + 0.07 * grain)[:, :, None], brick)
    return Wall(surface, blur(height, 0.7), brick, burnt, pits)


def bricks(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return a wall of red bricks, lit."""
    built = wall(rng)
    return finished(built.color * shade(built.height, 0.34)[:, :, None])


def bricks_material(rng: np.random.Generator) -> dict[str, NDArray[np.uint8] | NDArray[np.uint16]]:
    """Return the maps of the same wall: colours sRGB-coded, all else plain numbers, the height in 16 bits."""
    built = wall(rng)
    rough = mix(np.full(1, 0.92), np.full(1, 0.62), built.brick)[:, :, 0]
    rough = np.clip(rough - 0.32 * built.brick * built.burnt + 0.2 * built.pits, 0, 1)
    hollow = np.clip(blur(built.height, 4) - built.height, 0, None)
    # x to the right, y upward, z outward.
    down = (np.roll(built.height, -1, axis=0) - np.roll(built.height, 1, axis=0)) / 2
    right = (np.roll(built.height, -1, axis=1) - np.roll(built.height, 1, axis=1)) / 2
    normal = np.stack([-right, down, np.ones_like(down)], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    low, high = built.height.min(), built.height.max()
    return {
        "albedo": finished(built.color),
        "normal": eight_bits((normal + 1) / 2),
        "roughness": eight_bits(rough[:, :, None]),
        "ao": eight_bits(np.exp(-0.45 * hollow[:, :, None])),
        "height": (65535 * (built.height[:, :, None] - low) / (high - low) + 0.5).astype(np.uint16),
    }


def eight_bits(numbers: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return plain numbers from 0 to 1 as an image."""
    return np.asarray(255 * numbers + 0.5).astype(np.uint8)


def weave(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return plain woven cloth: indigo yarn across, cream yarn down, twelve of each."""
    count = 12
    # Yarns wander, and are a little thicker here and there.
    v = (ROWS + 0.8 * noise(rng, 1.6, low=4)) * (count / SIZE)
    u = (COLUMNS + 0.8 * noise(rng, 1.6, low=4)) * (count / SIZE)
    i, j = np.floor(v).astype(int) % count, np.floor(u).astype(int) % count
    thick = 0.455 + 0.012 * noise(rng, 1.6, low=8), 0.455 + 0.012 * noise(rng, 1.6, low=8)
    y, x = (v % 1 - 0.5) / thick[0], (u % 1 - 0.5) / thick[1]
    # Each yarn rises over one crossing and dives under the next; the higher one is seen.
    across = 0.7 * (1 - 2 * (i % 2)) * np.cos(np.pi * (u - 0.5)) + 1.5 * np.sqrt(np.clip(1 - y * y, 0, 1))
    down = -0.7 * (1 - 2 * (j % 2)) * np.cos(np.pi * (v - 0.5)) + 1.5 * np.sqrt(np.clip(1 - x * x, 0, 1))
    across, down = np.where(np.abs(y) < 1, across, -1.5), np.where(np.abs(x) < 1, down, -1.5)
    over = across > down
    height = np.maximum(across, down)
    # Strands twisted round each other, and single fibres along them.
    strands = np.where(
        over, np.sin(2 * np.pi * (2.6 * u + 0.42 * y)), np.sin(2 * np.pi * (2.6 * v + 0.42 * x))
    )
    fibres = np.where(over, noise(rng, 0.7, low=10, stretch=0.3), noise(rng, 0.7, low=10, stretch=0.3).T)
    share = 0.5 + 0.2 * strands + 0.15 * fibres
    indigo = mix(color("2c4a7c"), color("6d8cba"), share + rng.normal(0, 0.12, count)[i])
    cream = mix(color("b3a283"), color("efe6d2"), share + rng.normal(0, 0.12, count)[j])
    yarn = np.where(over[:, :, None], indigo, cream)
    cloth = mix(color("0c0d12"), yarn, 0.1 + 0.9 * smoothstep(-0.2, 2.0, height))
    cloth = np.stack([blur(cloth[:, :, k], 0.6) for k in range(3)], axis=2)
    relief = 2.2 * np.clip(height, -0.4, None) + 0.22 * strands + 0.08 * fibres
    return finished(1.15 * cloth * shade(blur(relief, 0.8), 0.32)[:, :, None])


def pebbles(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return rounded pebbles of several rocks in dark sand: a periodic Voronoi diagram, relaxed once."""
    count = 130
    points = rng.uniform(0, SIZE, (count, 2))
    warp = 2.2 * noise(rng, 1.5, low=5), 2.2 * noise(rng, 1.5, low=5)
    grid = np.stack([ROWS, COLUMNS], axis=2)
    for _ in range(2):
        nearest, _, _ = _cells(grid, points)
        for k in range(count):
            away = (grid[nearest == k] - points[k] + SIZE / 2) % SIZE - SIZE / 2
            points[k] += away.mean(axis=0)
    nearest, first, second = _cells(grid + np.stack(warp, axis=2), points)
    rim = second - first  # 0 where two pebbles would touch
    size = np.sqrt(np.bincount(nearest.ravel(), minlength=count))[nearest]
    stone = smoothstep(1.6, 4.2, rim + 0.5 * noise(rng, 0.9, low=8))
    dome = np.sqrt(np.clip(rim / (0.85 * size), 0, 1))
    tones = ("8d8478", "a39a8b", "6f6a66", "b8ab98", "7d6658", "948b84", "5e5f63", "c9c1b2", "9a7f69")
    shades = np.stack([color(code) for code in tones])[rng.integers(0, len(tones), count)]
    rock = shades[nearest] * rng.uniform(0.8, 1.2, count)[nearest][:, :, None]
    speckle, cloud = noise(rng, 0.3, low=20), noise(rng, 2.2, low=4)
    rock = rock * (1 + rng.uniform(0.03, 0.16, count)[nearest] * speckle + 0.10 * cloud)[:, :, None]
    angle = rng.uniform(0, np.pi, count)[nearest]
    veins = np.sin((ROWS * np.cos(angle) + COLUMNS * np.sin(angle)) * 0.45 + 1.2 * cloud)
    banded = (rng.uniform(size=count) < 0.3)[nearest]
    rock = mix(rock, color("e0d8ca"), 0.35 * banded * smoothstep(0.75, 1.0, veins))
    sand = mix(color("4a4036"), color("75685a"), 0.5 + 0.4 * noise(rng, 0.15))
    tilt = rng.normal(0, 0.02, (count, 2))[nearest]
    away = (grid - points[nearest] + SIZE / 2) % SIZE - SIZE / 2
    height = stone * (9 * dome + (tilt * away).sum(axis=2) + 0.10 * speckle) + (1 - stone) * 0.3 * speckle
    return finished(mix(sand, rock, stone) * shade(blur(height, 0.8), 0.24)[:, :, None])


def _cells(grid: NDArray[np.float64], points: NDArray[np.float64]) -> tuple[NDArray[np.intp], Field, Field]:
    """Return the index of the nearest point of each pixel, its distance, and that of the second."""
    away = np.abs(grid[:, :, None, :] - points) % SIZE
    distance = np.hypot(*np.moveaxis(np.minimum(away, SIZE - away), -1, 0))
    pair = np.partition(distance, 1, axis=2)
    return distance.argmin(axis=2), pair[:, :, 0], pair[:, :, 1]


def granite(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return polished granite: grains of feldspar, quartz and mica."""
    grains = rng.uniform(0, SIZE, (1500, 2))
    grid = np.stack([ROWS + 1.5 * noise(rng, 0.9, low=8), COLUMNS + 1.5 * noise(rng, 0.9, low=8)], axis=2)
    nearest = np.concatenate([_cells(band, grains)[0] for band in np.split(grid, 16)])
    # Neighbouring grains are of one mineral now and then: a slow field decides with a random one.
    at = grains.astype(int) % SIZE
    fate = 0.75 * noise(rng, 1.0, low=9)[at[:, 0], at[:, 1]] + rng.normal(0, 0.8, len(grains))
    minerals = [("b98a78", 0.9), ("cfae9c", 0.35), ("aaa6a2", -0.3), ("8b8885", -0.75), ("dcd3ca", -1.0)]
    tone = np.broadcast_to(color("2c2a2c"), (len(grains), 3)).copy()
    for code, above in reversed(minerals):
        tone[fate > above] = color(code)
    tone *= rng.uniform(0.8, 1.2, (len(grains), 1))
    stone = tone[nearest] * (1 + 0.10 * noise(rng, 0.5, low=20) + 0.05 * noise(rng, 1.2, low=4))[:, :, None]
    soft = np.stack([blur(stone[:, :, k], 0.6) for k in range(3)], axis=2)
    return finished(soft)


EXEMPLARS: dict[str, Callable[[np.random.Generator], NDArray[np.uint8]]] = {
    "bricks": bricks,
    "weave": weave,
    "pebbles": pebbles,
    "granite": granite,
}


def main(folder: Path) -> None:
    """Write every exemplar into `folder`, and the material into one of its own there."""
    images: dict[str, NDArray[np.uint8] | NDArray[np.uint16]] = {
        f"{name}.png": make(np.random.default_rng([2024, number]))
        for number, (name, make) in enumerate(EXEMPLARS.items())
    }
    for role, image in bricks_material(np.random.default_rng([2024, 0])).items():
        images[f"bricks_material/bricks_{role}.png"] = image
    for name, image in images.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        write_image(path, image)
        print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
