"""Poles: points inside a chart about which the direction turns, where charts are cut.

A warp field is bilinear between its nodes. About a point round which it turns, nodes on opposite sides
cancel, and between them the texture is stretched beyond all bounds. Charts that meet in that point have a
quarter of the turn each, and their nodes are fitted from inside (`upholster.charts.corner_fit`).
"""

from collections.abc import Sequence

import numpy as np

from upholster.charts.corner_fit import Corner
from upholster.charts.directions import LEAST_SLOPE, Direction, called
from upholster.geometry import Face, Surface
from upholster.quilt.chart import Chart
from upholster.types import FloatArray

__all__ = ["cut_at_poles"]

SIDE = 128
"""Texels: side of the charts that meet in a pole. Their blocks are small, so they are no larger."""

LEAST = 48
"""Texels: least side of any chart that is made."""

PLACES = 12
"""Of a grid over a chart in whose cells poles are looked for, each way."""

STEPS = 12
"""Of Newton's method; each about doubles the digits."""

ROUND, RADIUS = 16, 16
"""Places on a circle about a pole on which the direction turns evenly, and its radius in texels."""

MOST_STEP = np.radians(60)
"""By so much it turns at most from one of them to the next: where lines of equal height close, signs jump."""

PRECISION = 13
"""Poles are settled to 1/2^13 of a patch: as many bits are told of a chart's edges."""


def cut_at_poles(
    surface: Surface, charts: Sequence[Chart], direction: Direction
) -> tuple[tuple[Chart, ...], dict[int, Corner]]:
    """Cut charts about whose inner points a direction turns, so that four of them meet in each such point.

    Of a large chart these four are cut out, and what is left lies above, below and beside them.

    Parameters
    ----------
    surface, charts
        The layout.
    direction
        Which way the exemplar's rows of pixels run.

    Returns
    -------
    tuple
        The charts: those without a pole as they were, in the same order.
    dict
        For each chart that a pole is a corner of, by its number, which one.
    """
    if direction.along not in ("", "level"):
        return tuple(charts), {}
    found: list[tuple[Chart, Corner | None]] = []
    for chart in charts:
        pole = _pole(surface.faces[chart.face], chart, direction)
        found += [(chart, None)] if pole is None else _cut(chart, *pole)
    corners = {n: corner for n, (_, corner) in enumerate(found) if corner is not None}
    return tuple(chart for chart, _ in found), corners


def _pole(face: Face, chart: Chart, direction: Direction) -> tuple[float, float] | None:
    """Return the parameters of the first pole inside a chart that is far enough from its edges."""
    if min(chart.height, chart.width) < 2 * LEAST:
        return None
    low, step = _texels(chart)
    size = np.array([chart.height, chart.width])
    rows, columns = (np.linspace(0, count, PLACES) for count in size)
    places = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1)
    around = np.stack([places[:-1, :-1], places[:-1, 1:], places[1:, 1:], places[1:, :-1]], axis=2)
    seen = _seen(face, low + step * places.reshape(-1, 2), direction).reshape(*places.shape[:2], 2)
    if not np.hypot(seen[..., 0], seen[..., 1]).max() > LEAST_SLOPE:
        return None
    turning = np.stack([seen[:-1, :-1], seen[:-1, 1:], seen[1:, 1:], seen[1:, :-1]], axis=2)
    for cell in around[np.abs(_turns(turning)) > 0.5]:
        at = _zero(face, low, step, cell.mean(axis=0), direction)
        if at is None or not ((at >= LEAST) & (at <= size - LEAST)).all():
            continue
        pole = np.rint((low + step * at) * 2.0**PRECISION) / 2.0**PRECISION
        angle = 2 * np.pi * np.arange(ROUND) / ROUND
        circle = pole + RADIUS * step * np.stack([np.sin(angle), np.cos(angle)], axis=1)
        seen = _seen(face, circle, direction)
        if np.abs(_steps(seen)).max() < MOST_STEP and abs(abs(float(_turns(seen))) - 1) < 0.01:
            return float(pole[0]), float(pole[1])
    return None


def _texels(chart: Chart) -> tuple[FloatArray, FloatArray]:
    """Return a chart's first parameters, and those that a texel takes."""
    low = np.array([chart.s0, chart.t0])
    return low, (np.array([chart.s1, chart.t1]) - low) / (chart.height, chart.width)


def _seen(face: Face, at: FloatArray, direction: Direction) -> FloatArray:
    """Return the part (n, 2) of the direction along rows and across them, at parameters (n, 2).

    Of directions that are vectors the longest has length 1.
    """
    points, down, right = face.derivatives(at[:, 0], at[:, 1])
    normal = np.cross(down, right)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    right = right / np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-300)
    if direction.vectors is None:
        vectors = np.cross((0.0, 0.0, 1.0), normal)
    else:
        vectors = called(direction.vectors, points)
        vectors = vectors / max(float(np.linalg.norm(vectors, axis=1).max()), 1e-300)
    across = np.cross(right, normal)
    return np.stack([(vectors * right).sum(axis=1), (vectors * across).sum(axis=1)], axis=1)


def _steps(seen: FloatArray) -> FloatArray:
    """Return the angles (…, n) from each of vectors (…, n, 2) to the next one round."""
    after = np.roll(seen, -1, axis=-2)
    sine = seen[..., 0] * after[..., 1] - seen[..., 1] * after[..., 0]
    found: FloatArray = np.arctan2(sine, (seen * after).sum(axis=-1))
    return found


def _turns(seen: FloatArray) -> FloatArray:
    """Return how often vectors (…, n, 2) turn on the way round."""
    found: FloatArray = _steps(seen).sum(axis=-1) / (2 * np.pi)
    return found


def _zero(
    face: Face, low: FloatArray, step: FloatArray, start: FloatArray, direction: Direction
) -> FloatArray | None:
    """Return where the direction vanishes, in texels, by Newton's method; None if that leads nowhere."""
    at = start
    for _ in range(STEPS):
        near = at + np.array([[0.0, 0.0], [0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]])
        seen = _seen(face, low + step * near, direction)
        slope = np.stack([seen[1] - seen[2], seen[3] - seen[4]], axis=1)
        if not np.isfinite(slope).all() or abs(np.linalg.det(slope)) < 1e-12:
            return None
        move = np.linalg.solve(slope, seen[0])
        at = at - move * min(1.0, 64.0 / max(float(np.abs(move).max()), 1e-300))
    return at if np.isfinite(at).all() and float(np.abs(move).max()) < 0.1 else None


def _cut(chart: Chart, s: float, t: float) -> list[tuple[Chart, Corner | None]]:
    """Return the charts in place of one, with the corner of those that meet in a pole."""
    down, right = (
        _lines(*ends)
        for ends in ((chart.s0, s, chart.s1, chart.height), (chart.t0, t, chart.t1, chart.width))
    )
    texels = chart.height / (chart.s1 - chart.s0), chart.width / (chart.t1 - chart.t0)

    def part(rows: tuple[float, float], columns: tuple[float, float]) -> Chart:
        height, width = (
            int((high - low) * count + 0.5)
            for (low, high), count in zip((rows, columns), texels, strict=True)
        )
        return Chart(chart.face, height, width, *rows, *columns)

    above, upper, middle, lower, below = down
    before, left, centre, beyond, behind = right
    parts: list[tuple[Chart, Corner | None]] = [
        (part(rows, columns), corner)
        for rows, columns, corner in (
            ((above, upper), (before, behind), None),
            ((upper, lower), (before, left), None),
            ((upper, middle), (left, centre), Corner(True, True)),
            ((upper, middle), (centre, beyond), Corner(True, False)),
            ((middle, lower), (left, centre), Corner(False, True)),
            ((middle, lower), (centre, beyond), Corner(False, False)),
            ((upper, lower), (beyond, behind), None),
            ((lower, below), (before, behind), None),
        )
        if rows[0] < rows[1] and columns[0] < columns[1]
    ]
    return parts


def _lines(low: float, pole: float, high: float, texels: int) -> tuple[float, float, float, float, float]:
    """Return where a chart is cut along one axis: its ends, the pole, and a chart's side before and behind.

    Where less than another chart would be left the side reaches as far as the end.
    """
    texel = (high - low) / texels
    # Few bits tell it.
    unit = 2.0 ** np.floor(np.log2(4 * texel))
    side = unit * np.rint(SIDE * texel / unit)
    least = (SIDE + LEAST) * texel
    before = pole - side if pole - low >= least else low
    behind = pole + side if high - pole >= least else high
    return low, float(before), pole, float(behind), high
