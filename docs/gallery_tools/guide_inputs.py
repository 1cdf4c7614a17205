"""What pictures of guides need beside samples: a house, a label map that is painted, and a sign."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

__all__ = ["draw_inputs"]

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))
from make_chair import write_glb

Point = tuple[float, float, float]
Solid = tuple[list[Point], list[tuple[int, ...]]]
"""Points with z up, x east and y north; and faces, counter-clockwise from outside."""

RUST, BARE = (176, 80, 30), (214, 214, 220)
"""Colours of labels."""

_BLUE, _WHITE = (24, 52, 110, 255), (245, 243, 235, 255)


def draw_inputs(folder: Path) -> None:
    """Write house.glb, numbers.png and sign.png to a folder."""
    write_glb(folder / "house.glb", {name: _part(solids) for name, solids in _house().items()})
    _numbers().save(folder / "numbers.png", optimize=True)
    _sign().quantize(64).save(folder / "sign.png", optimize=True)


def _house() -> dict[str, list[Solid]]:
    shutters = [(x, 5.3, 1.2, x + 0.8, 5.47, 2.4) for x in (1.6, 4.0)]
    shutters += [(8.9, y, 1.2, 9.07, y + 0.8, 2.4) for y in (1.0, 3.5)]
    shutters += [(8.9, 2.4, 3.5, 9.07, 3.0, 4.3), (-1.2, 4.0, 5.4, -0.6, 4.17, 6.7)]
    shutters += [(0.4, 2.4, 6.2, 0.57, 3.0, 7.2)]
    return {
        "Walls": [_gabled(9.0, 5.4, 3.2, 5.7), _box(-2.3, 1.3, 0.0, 0.5, 4.1, 7.6)],
        "Roof": [_roof(0.05, 8.95, 5.4, 2.95, 6.0), _pyramid(-2.6, 1.0, 7.6, 3.4, 10.6)],
        "Wood": [_box(6.8, 5.3, 0.0, 7.9, 5.47, 2.2), *(_box(*one) for one in shutters)],
    }


def _part(solids: list[Solid]) -> tuple[Any, Any, Point]:
    points: list[Point] = []
    triangles = []
    for own, faces in solids:
        first = len(points)
        points += own
        for face in faces:
            triangles += [[first + face[k] for k in (0, j, j + 1)] for j in range(1, len(face) - 1)]
    x, y, z = np.array(points).T
    return np.stack([x, z, -y], axis=1), np.array(triangles), (0.0, 0.0, 0.0)


def _box(x0: float, y0: float, z0: float, x1: float, y1: float, z1: float) -> Solid:
    points = [(x, y, z) for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    sides = [(k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4)]
    return points, [(0, 3, 2, 1), (4, 5, 6, 7), *sides]


def _gabled(x1: float, y1: float, eaves: float, ridge: float) -> Solid:
    # Walls alone: no floor, and nothing below the roof.
    points, faces = _box(0.0, 0.0, 0.0, x1, y1, eaves)
    points += [(0.0, y1 / 2, ridge), (x1, y1 / 2, ridge)]
    return points, [faces[2], faces[4], (1, 2, 6, 9, 5), (3, 0, 4, 8, 7)]


def _roof(x0: float, x1: float, y1: float, eaves: float, ridge: float, over: float = 0.4) -> Solid:
    # Solid: the two sides of a thin roof would lie so near each other that they are blended.
    outline = [(-over, eaves), (y1 / 2, ridge), (y1 + over, eaves)]
    points = [(x, y, z) for x in (x0, x1) for y, z in outline]
    sides = [(k + 3, (k + 1) % 3 + 3, (k + 1) % 3, k) for k in range(3)]
    return points, [(0, 1, 2), (5, 4, 3), *sides]


def _pyramid(x0: float, y0: float, z0: float, side: float, top: float) -> Solid:
    corners = [(x0, y0, z0), (x0 + side, y0, z0), (x0 + side, y0 + side, z0), (x0, y0 + side, z0)]
    faces = [(k, (k + 1) % 4, 4) for k in range(4)]
    return [*corners, (x0 + side / 2, y0 + side / 2, top)], [(0, 3, 2, 1), *faces]


def _numbers() -> Any:
    mask = Image.new("1", (512, 256), 0)
    font = ImageFont.load_default(size=195)
    ImageDraw.Draw(mask).text((256, 128), "1889", font=font, fill=1, anchor="mm", stroke_width=6)
    return Image.composite(Image.new("RGB", mask.size, RUST), Image.new("RGB", mask.size, BARE), mask)


def _sign() -> Any:
    # Drawn at four times the size: so its outline is smooth.
    image = Image.new("RGBA", (1024, 1024), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    for inset, color in ((8, _BLUE), (50, _WHITE), (80, _BLUE)):
        draw.ellipse((inset, inset, 1024 - inset, 1024 - inset), fill=color)
    font = ImageFont.load_default(size=600)
    draw.text((512, 512), "12", font=font, fill=_WHITE, anchor="mm", stroke_width=14)
    return image.resize((256, 256), Image.Resampling.LANCZOS)
