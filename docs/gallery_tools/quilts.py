"""Figures of method "quilt": surfaces, scale, direction, the paper's method beside it, flat textures."""

from typing import Any

import numpy as np
from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars, cover, read, take
from upholster import paint, synthesize
from upholster.geometry import plane, ring_cyclide, surface_from_spec, torus

__all__ = ["beside", "directions", "everywhere", "flat", "sizes"]

EVERYWHERE = {
    "cyclide": 6.0,
    "torus": 1.4,
    "sphere": 0.6,
    "vase": 0.6,
    "ellipsoid": 0.7,
    "cylinder": 0.6,
    "cone": 0.6,
    "sphere:tiling=octants": 0.6,
}
"""What the figure of surfaces shows, in order, and the sample's size there."""

WAYS = ("u", "v", "30", "0,0,1", "around:z", "swirl")
"""What the figure of directions shows, in order; the last is a function."""


def everywhere(_exemplars: Exemplars) -> Any:
    """Cover every built-in surface with one exemplar."""
    exemplar = read(OWN / "pebbles.png")
    panels = []
    for letter, (name, size) in zip("abcdefgh", EVERYWHERE.items(), strict=True):
        surface = surface_from_spec(name)
        model = cover(surface, exemplar, texels=1_000_000, sample_size=size, seed=1)
        view = (150.0, 32.0) if name == "cyclide" else (30.0, 28.0)
        words = name.replace(":tiling=", " of ")
        panels.append(Panel(take(model, size=(340, 300), view=view).image, f"({letter}) {words}"))
    return compose([panels[:4], panels[4:]], gap=14)


def sizes(_exemplars: Exemplars) -> Any:
    """Cover a torus with one exemplar in three sizes."""
    exemplar, surface = read(OWN / "pebbles.png"), torus(2.0, 0.9)
    panels = []
    for letter, size in zip("abc", (0.8, 1.6, 3.2), strict=True):
        model = cover(surface, exemplar, texels=4_000_000, sample_size=size, seed=1)
        shot = take(model, size=(460, 350), view=(30.0, 38.0))
        panels.append(Panel(shot.image, f"({letter}) --sample-size {size:g}"))
    return compose([panels], gap=14)


def directions(_exemplars: Exemplars) -> Any:
    """Let the rows of one exemplar run six ways over the cyclide."""
    exemplar, surface = read(OWN / "bricks.png"), ring_cyclide()
    panels = []
    for letter, way in zip("abcdef", WAYS, strict=True):
        model = cover(
            surface,
            exemplar,
            texels=2_000_000,
            sample_size=6.0,
            seed=1,
            direction=_swirl if way == "swirl" else way,
        )
        words = "a function in Python" if way == "swirl" else way
        panels.append(Panel(take(model, size=(460, 350), view=(150.0, 32.0)).image, f"({letter}) {words}"))
    return compose([panels[:3], panels[3:]], gap=14)


def _swirl(points: Any) -> Any:
    """Return vectors that turn from round the axis to along it as z grows."""
    x, y, z = points.T
    turn = np.pi / 4 * (1 + z / np.abs(z).max())
    far = np.hypot(x, y)
    return np.stack([-y / far * np.cos(turn), x / far * np.cos(turn), np.sin(turn)], axis=1)


def beside(_exemplars: Exemplars) -> Any:
    """Cover the cyclide with two exemplars by either method."""
    surface = ring_cyclide()
    rows = []
    for name, direction in (("bricks.png", "around:z"), ("pebbles.png", "u")):
        exemplar = read(OWN / name)
        paper = cover(surface, exemplar, method="paper", chart=512, block=64, overlap=16, seed=1)
        quilt = cover(surface, exemplar, texels=4_000_000, sample_size=5.0, direction=direction, seed=5)
        rows.append([
            Panel(take(model, size=(640, 480), view=(150.0, 32.0)).image, title)
            for model, title in ((paper, "method paper"), (quilt, "method quilt"))
        ])  # fmt: skip
    return compose(rows, gap=14)


def flat(exemplars: Exemplars) -> Any:
    """Make flat textures, one that tiles twice each way; the exemplars beside them."""
    surface = plane()
    rows = []
    for path, letters in ((OWN / "bricks.png", "abc"), (exemplars.pick("stone_wall"), "def")):
        exemplar = read(path, 128)
        plain, tile = (
            paint(synthesize(exemplar, surface, texels=size, seed=1, tileable=wraps), exemplar).arrays[0]
            for size, wraps in (((512, 512), False), ((256, 256), True))
        )
        rows.append([
            Panel(Image.fromarray(exemplar), f"({letters[0]}) 128 x 128"),
            Panel(Image.fromarray(plain), f"({letters[1]}) 512 x 512"),
            Panel(Image.fromarray(np.tile(tile, (2, 2, 1))), f"({letters[2]}) four tiles of 256 x 256"),
        ])  # fmt: skip
    return compose(rows)
