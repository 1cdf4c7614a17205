"""Figures of the geometry: the surface, its patches and polygons, the mapping, and the stretch it causes."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from gallery_tools.drawing import INK, PAPER, Panel, compose, heat, text
from gallery_tools.overlay import Overlay
from gallery_tools.shots import Exemplars, charted, cover, read, take
from upholster.base.types import FloatArray
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["mapping", "patches", "stretch", "stretch_ratios", "surface"]

RED, BLUE, DARK = (190, 40, 30), (25, 85, 175), (45, 48, 54)
SPANS = 4
TINTS = np.array(
    [[(232, 196, 120), (214, 140, 110)], [(150, 190, 150), (130, 165, 205)]], np.uint8
)  # by parity of θ's span and of φ's


def surface(_exemplars: Exemplars) -> Any:
    """Draw figure 1: the surface in clay, and where θ and φ start and which way they run."""
    ring = ring_cyclide()
    size, view = (660, 500), (118.0, 40.0)
    plain = take(ring, size=size, view=view)
    layer = plain.overlay()
    around = np.linspace(0, 2 * np.pi, 400)
    for k in range(1, 16):
        angle = k * np.pi / 8
        layer.curve(_point(angle, around), DARK, width=0.8, hidden=0)
        layer.curve(_point(around, angle), DARK, width=0.8, hidden=0)
    layer.curve(_point(0.0, around), RED, width=3)
    layer.curve(_point(around, 0.0), BLUE, width=3)
    half = np.pi
    theta_way = _point(np.linspace(1.12, 1.6, 60) * half, np.full(60, 1.5 * half))
    phi_way = _point(np.full(60, 0.375 * half), np.linspace(1.08, 1.7, 60) * half)
    for color, line in ((BLUE, theta_way), (RED, phi_way)):
        layer.curve(line, color, width=5)
        layer.head(line, color, size=24)
    layer.label(theta_way[30], "θ", color=BLUE, size=30, shift=(30, 4))
    layer.label(phi_way[30], "φ", color=RED, size=30, shift=(34, 4))
    layer.label(_point(0.0, 1.2 * half), "θ = 0", color=RED, shift=(-46, 18))
    layer.label(_point(half, 0.0), "φ = 0", color=BLUE, shift=(6, 24))
    return compose(
        [[
            Panel(plain.image, "(a) ring Dupin cyclide, a = 6, c = 2, µ = 3"),
            Panel(layer.finish(), "(b) where θ and φ start, and which way they run"),
        ]]
    )  # fmt: skip


def patches(_exemplars: Exemplars) -> Any:
    """Draw figure 2: four patches with their Bézier polygons, and the whole of sixteen."""
    ring = ring_cyclide()
    size = (660, 520)
    chosen = [SPANS * p + q for p in (0, 1) for q in (0, 1)]
    quarter = Surface([ring.patches[n] for n in chosen], "quarter")
    nets = [patch.control_points for patch in quarter.patches]
    shot = take(
        charted(quarter, [_tinted(n) for n in chosen]),
        size=size, view=(180.0, -45.0), around=np.concatenate([net.reshape(-1, 3) for net in nets]),
    )  # fmt: skip
    layer = shot.overlay()
    for patch in quarter.patches:
        _outline(layer, patch, hidden=50)
    for net in nets:
        for i in range(3):
            for j in range(3):
                if i < 2:
                    layer.segment(net[i, j], net[i + 1, j], BLUE, width=1.8)
                if j < 2:
                    layer.segment(net[i, j], net[i, j + 1], BLUE, width=1.8)
    for net in nets:
        for point in net.reshape(-1, 3):
            layer.dot(point, RED, radius=4.5)
    whole = take(charted(ring, [_tinted(n) for n in range(16)]), size=size, view=(118.0, 40.0))
    borders = whole.overlay()
    for patch in ring.patches:
        _outline(borders, patch, hidden=0)
    return compose(
        [[
            Panel(layer.finish(), "(a) the quarter with θ, φ from 0° to 180°, and its Bézier polygons"),
            Panel(borders.finish(), "(b) the whole: sixteen patches"),
        ]]
    )  # fmt: skip


def mapping(exemplars: Exemplars) -> Any:
    """Draw figure 10: quadrilaterals on the model, and the same ones in texture space."""
    count, marked = 8, 6
    ring = ring_cyclide()
    exemplar = read(exemplars.pick("brick_wall_old"))
    model = cover(ring, exemplar, method="paper", chart=256, block=64, overlap=16, seed=2)
    shot = take(model, size=(760, 576), view=(150.0, 34.0))
    layer = shot.overlay()
    steps = np.linspace(0, 1, count + 1)
    fine = np.linspace(0, 1, 12 * count + 1)
    for patch in ring.patches:
        for lines in (patch.points_grid(steps, fine), patch.points_grid(fine, steps).swapaxes(0, 1)):
            for line in lines[1:-1]:
                layer.curve(line, PAPER, width=1.0, hidden=0)
    for patch in ring.patches:
        _outline(layer, patch, hidden=0)
    texels = model.texels.arrays[marked]
    side = 576
    flat = Image.fromarray(texels).resize((side, side), Image.Resampling.LANCZOS).convert("RGB")
    shade = Image.new("RGBA", (side, side))
    pen = ImageDraw.Draw(shade)
    step = side // count
    patch = ring.patches[marked]
    for (row, column), color in _MARKED.items():
        box = (column * step, row * step, (column + 1) * step, (row + 1) * step)
        pen.rectangle(box, fill=(*color, 150))
        s = np.array([row, row + 1]) / count
        t = np.array([column, column + 1]) / count
        corners = patch.points_grid(s, t)[[0, 1, 1, 0], [0, 0, 1, 1]]
        layer.polygon(corners, color, 170)
    for k in range(count + 1):
        at = min(k * step, side - 1)
        edge = k in (0, count)
        for line in ((at, 0, at, side), (0, at, side, at)):
            pen.line(line, fill=(*(INK if edge else PAPER), 255), width=4 if edge else 1)
    flat.paste(shade, (0, 0), shade)
    return compose(
        [[
            Panel(layer.finish(), "(a) quadrilaterals on the model, uniform in each patch's parameters"),
            Panel(flat, "(b) the same quadrilaterals of one patch in texture space"),
        ]],
        gap=40,
    )  # fmt: skip


_MARKED = {
    (1, 1): (220, 50, 40),
    (1, 5): (250, 190, 30),
    (4, 3): (40, 150, 70),
    (6, 6): (40, 110, 210),
    (3, 6): (150, 60, 170),
}


def stretch(_exemplars: Exemplars) -> Any:
    """Draw what a plain mapping does to scale."""
    ring = ring_cyclide()
    size, view = (620, 480), (150.0, 34.0)
    dots = take(charted(ring, [_dots(32, 12)] * len(ring.patches)), size=size, view=view)
    scales = [np.sqrt(area) for _, _, area in _steps(ring)]
    least, most = min(float(s.min()) for s in scales), max(float(s.max()) for s in scales)
    top = np.log(most / least)
    maps = take(charted(ring, [heat(np.log(s / least) / top) for s in scales]), size=size, view=view)
    bar = Image.new("RGB", (110, size[1]), PAPER)
    pen = ImageDraw.Draw(bar)
    y0, y1 = 50, size[1] - 20
    for row in range(y0, y1):
        color = heat((y1 - row) / (y1 - y0))
        pen.line((8, row, 38, row), fill=tuple(int(c) for c in color))
    for value in (1.0, 1.5, 2.0, 3.0, 4.0, most / least):
        y = y1 - float(np.log(value) / top) * (y1 - y0)
        pen.line((38, y, 46, y), fill=INK, width=2)
        text(pen, (52, y), f"x {value:.2g}", size=18)
    text(pen, (8, 18), "scale", size=18)
    return compose(
        [[
            Panel(dots.image, "(a) equal dots, mapped by the patches' parameters"),
            Panel(maps.image, "(b) scale: size of a texel against the smallest"),
            Panel(bar, ""),
        ]],
        gap=16,
    )  # fmt: skip


def stretch_ratios() -> tuple[float, float, float]:
    """Return how many times the largest exceeds the smallest: a texel's length, its width, its area."""
    found = list(zip(*_steps(ring_cyclide()), strict=True))
    ratios = [max(float(v.max()) for v in values) / min(float(v.min()) for v in values) for values in found]
    return ratios[0], ratios[1], ratios[2]


def _steps(ring: Surface) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Return per patch how long a step along s, a step along t and how large their parallelogram is."""
    middle = (np.arange(128) + 0.5) / 128
    steps: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for patch in ring.patches:
        _, along_s, along_t = patch.derivatives_grid(middle, middle)
        area = np.linalg.norm(np.cross(along_s, along_t), axis=-1)
        steps.append((np.linalg.norm(along_s, axis=-1), np.linalg.norm(along_t, axis=-1), area))
    return steps


def _dots(step: int, count: int) -> NDArray[np.uint8]:
    """Return a sheet of round dots, `count` each way, `step` texels apart, that continues itself."""
    at = (np.arange(step * count) + 0.5) % step - step / 2
    far = np.hypot(at[:, None], at[None, :]) / step
    share = np.clip((0.34 - far) * step + 0.5, 0, 1)[..., None]
    color: FloatArray = (1 - share) * (238, 232, 220) + share * (176, 52, 44)
    return color.round().astype(np.uint8)


def _tinted(patch: int) -> NDArray[np.uint8]:
    color = TINTS[patch // SPANS % 2, patch % 2]
    return np.broadcast_to(color, (32, 32, 3)).copy()


def _outline(layer: Overlay, patch: RationalPatch, *, hidden: int) -> None:
    fine = np.linspace(0, 1, 120)
    ends = np.array([0.0, 1.0])
    for line in (*patch.points_grid(ends, fine), *patch.points_grid(fine, ends).swapaxes(0, 1)):
        layer.curve(line, INK, width=2.2, hidden=hidden)


def _point(theta: ArrayLike, phi: ArrayLike, a: float = 6.0, c: float = 2.0, mu: float = 3.0) -> FloatArray:
    """Return points of the cyclide's trigonometric form (the paper's section 3)."""
    theta, phi = np.broadcast_arrays(theta, phi)
    b = np.sqrt(a * a - c * c)
    below = a - c * np.cos(theta) * np.cos(phi)
    x = (mu * (c - a * np.cos(theta) * np.cos(phi)) + b * b * np.cos(theta)) / below
    y = b * (a - mu * np.cos(phi)) * np.sin(theta) / below
    z = b * (c * np.cos(theta) - mu) * np.sin(phi) / below
    return np.stack([x, y, z], axis=-1)
