"""Flattening one piece of a mesh, and the quality of the result."""

from typing import NamedTuple

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._flatten_kernels import (
    count_crossings,
    relax,
    rest_shapes,
    singular_values,
    unfold,
    untangle,
)
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.charts.unwrap.pieces import Piece

__all__ = ["Flat", "flatten", "percentile", "shapes_of", "signed_areas", "stretches"]

_LEAST_HEIGHT = 1e-3
"""Least height over longest edge; thinner triangles are treated as this high so that they can be computed."""
_FIRST_ROUNDS, _ROUNDS, _STEPS, _TOLERANCE = 3, 5, 100, 1e-2
_HOPELESS = 0.03
"""Share of flipped triangles after the first rounds that further rounds cannot repair."""
_MOST_TRIANGLES = 40_000
"""Larger pieces that cannot be unrolled take longer than their parts."""
_SWEEPS = 40
_LEAST_DETERMINANT = 0.05
"""Triangles whose area shrinks below this factor count as flipped."""


_MOST_SPREAD, _MOST_STRETCH = 2.0, 2.0
_UNROLLED = 1.02
_ROUNDING = 5e-4
"""Share of samples that may be on an edge and count for both of its triangles."""


class Flat(NamedTuple):
    """A flattened piece.

    Attributes
    ----------
    parameters
        (N, 3, 2): the parameters of its triangles' corners.
    flipped
        Number of triangles that are inverted or have no area.
    crossings
        Number of pairs of border edges that cross, or if there is none, of samples under several triangles.
    spread
        Spread of its area: 99th percentile of (flattened area)/(area in space) over the 1st.
    stretch
        99th percentile of the ratio of a triangle's singular values.
    """

    parameters: FloatArray
    flipped: int
    crossings: int
    spread: float
    stretch: float

    @property
    def good(self) -> bool:
        """Whether no triangle is flipped, none overlaps another, and its area is even."""
        whole = self.flipped == 0 and self.crossings == 0
        return whole and self.spread <= _MOST_SPREAD and self.stretch <= _MOST_STRETCH


def shapes_of(corners: FloatArray) -> FloatArray:
    """Place triangles in the plane one by one, (T, 3): see `rest_shapes`.

    Parameters
    ----------
    corners
        (T, 3, 3): positions.
    """
    shapes = np.empty((len(corners), 3))
    rest_shapes(np.ascontiguousarray(corners), _LEAST_HEIGHT, shapes)
    return shapes


def flatten(
    piece: Piece, corners: FloatArray, areas: FloatArray, normals: FloatArray, starts: int = 2
) -> Flat:
    """Flatten a piece, as rigidly as possible, with the same area as in space.

    A developable piece is unfolded from its middle. Otherwise flattening starts from the piece projected
    along its mean normal; if that fails, from the unfolded piece.

    Parameters
    ----------
    piece
        A piece without handles, with a border.
    corners, areas, normals
        (N, 3, 3) positions of its triangles' corners, (N,) areas and (N, 3) unit normals.
    starts
        1 omits the last of the three.
    """
    shapes = shapes_of(corners)
    unfolded = _unfolded(piece, corners, areas, shapes)
    flat = _judged(piece, unfolded, areas, shapes)
    grown = signed_areas(unfolded[piece.vertex]).sum() / max(float(areas.sum()), 1e-300)
    if flat.good and max(flat.spread, flat.stretch, grown) < _UNROLLED:
        return flat
    if len(areas) > _MOST_TRIANGLES:
        return flat._replace(flipped=max(flat.flipped, 1))
    flat = _laid(piece, _seen(piece, corners, areas, normals), areas, shapes)
    if flat.good or starts == 1:
        return flat
    return min(flat, _laid(piece, unfolded, areas, shapes), key=_badness)


def _seen(piece: Piece, corners: FloatArray, areas: FloatArray, normals: FloatArray) -> FloatArray:
    """Return a piece's vertices projected along its mean normal, (V, 2)."""
    facing = (normals * areas[:, None]).sum(axis=0)
    facing = facing / max(float(np.linalg.norm(facing)), 1e-300)
    other = np.eye(3)[int(np.argmin(np.abs(facing)))]
    down = np.cross(other, facing)
    down = down / max(float(np.linalg.norm(down)), 1e-300)
    points = np.zeros((piece.vertices, 2))
    right = np.cross(facing, down)
    points[piece.vertex] = np.stack([(corners * down).sum(axis=2), (corners * right).sum(axis=2)], axis=2)
    return points


def _unfolded(piece: Piece, corners: FloatArray, areas: FloatArray, shapes: FloatArray) -> FloatArray:
    points = np.zeros((piece.vertices, 2))
    centres = corners.mean(axis=1)
    middle = (centres * areas[:, None]).sum(axis=0) / max(areas.sum(), 1e-300)
    first = int(np.argmin(((centres - middle) ** 2).sum(axis=1)))
    unfold(piece.across, shapes, piece.vertex, first, points)
    return points


def _laid(piece: Piece, points: FloatArray, areas: FloatArray, shapes: FloatArray) -> Flat:
    relax(shapes, piece.vertex, points, _FIRST_ROUNDS, _STEPS, _TOLERANCE)
    values = np.empty((len(areas), 2))
    singular_values(shapes, points[piece.vertex], values)
    if (values[:, 0] <= 0).mean() > _HOPELESS:
        return _judged(piece, points, areas, shapes)
    relax(shapes, piece.vertex, points, _ROUNDS, _STEPS, _TOLERANCE)
    untangle(shapes, piece.vertex, points, _LEAST_DETERMINANT, _SWEEPS)
    return _judged(piece, points, areas, shapes)


def _badness(flat: Flat) -> tuple[int, int, float]:
    return flat.flipped, flat.crossings, flat.spread


def _judged(piece: Piece, points: FloatArray, areas: FloatArray, shapes: FloatArray) -> Flat:
    turned = signed_areas(points[piece.vertex])
    scale = np.sqrt(areas.sum() / max(float(turned.sum()), 1e-300))
    border = piece.border()
    crossed = int(count_crossings(points[border], border)) if len(border) else 0
    if crossed == 0 and len(areas) > 1:
        crossed = _covered_twice(points[piece.vertex])
    real = areas > 0
    low, high = percentile(turned[real] / areas[real], areas[real], (0.01, 0.99))
    return Flat(
        (_turned_upright(points, border) * scale)[piece.vertex],
        int((turned[real] <= 0).sum()),
        crossed,
        high / max(low, 1e-9),
        percentile(stretches(shapes, points[piece.vertex]), areas, (0.99,))[0],
    )


def _covered_twice(corners: FloatArray) -> int:
    """Count samples under several triangles: borders that coincide do not cross."""
    side = 32 + 4 * int(np.sqrt(len(corners)))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    step = max(float((high - low).max()) / side, 1e-300)
    rows, columns = (int(count) + 1 for count in (high - low) / step)
    times = np.zeros((rows, columns), np.int32)
    coverage((corners - low) / step, times)
    several, covered = int((times > 1).sum()), int((times > 0).sum())
    return several if several > 1 + _ROUNDING * covered else 0


def _turned_upright(points: FloatArray, border: IntArray) -> FloatArray:
    """Rotate a piece so that its bounding rectangle is small."""
    edges = points[border[:, 1]] - points[border[:, 0]]
    longest = edges[np.argsort(-(edges**2).sum(axis=1), kind="stable")[:16]]
    angles = np.concatenate([np.arctan2(longest[:, 0], longest[:, 1]), np.radians(np.arange(0.0, 90.0, 3.0))])
    cosine, sine = np.cos(angles), np.sin(angles)
    s, t = points[border[:, 0], :1], points[border[:, 0], 1:]
    rows, columns = np.ptp(s * cosine - t * sine, axis=0), np.ptp(t * cosine + s * sine, axis=0)
    best = int(np.argmin(rows * columns * (1 + 1e-9 * np.arange(len(angles)))))
    c, d = cosine[best], sine[best]
    return np.stack([c * points[:, 0] - d * points[:, 1], d * points[:, 0] + c * points[:, 1]], axis=1)


def signed_areas(corners: FloatArray) -> FloatArray:
    """Return areas in parameters, (T,), positive where a triangle has the same orientation as in space.

    Parameters
    ----------
    corners
        (T, 3, 2): (s, t).
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    out: FloatArray = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return out


def stretches(shapes: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the ratio between the longest and the shortest stretch of each triangle, (T,).

    Parameters
    ----------
    shapes
        (T, 3): see `shapes_of`.
    corners
        (T, 3, 2): (s, t).
    """
    values = np.empty((len(shapes), 2))
    singular_values(shapes, corners, values)
    return values[:, 1] / np.maximum(values[:, 0], 1e-9)


def percentile(values: FloatArray, weights: FloatArray, shares: tuple[float, ...]) -> list[float]:
    """Return the values below which these shares of the weight are; 1 without values."""
    if not len(values):
        return [1.0] * len(shares)
    order = np.argsort(values, kind="stable")
    summed = np.cumsum(weights[order])
    places = np.searchsorted(summed, np.array(shares) * summed[-1])
    return [float(values[order[min(place, len(order) - 1)]]) for place in places]
