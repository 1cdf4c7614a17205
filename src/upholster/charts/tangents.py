"""Grids of tangent frames on a surface, and lines in them: filled where there are none, of one sign."""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import Face, RationalPatch
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import FIELD_STEP, node_count
from upholster.types import FloatArray

__all__ = [
    "Frames",
    "aligned",
    "chart_frames",
    "dot",
    "from_nearest",
    "node_texels",
    "patch_frames",
    "within",
]

TINY = 1e-9
"""Derivatives shorter than this part of the longest near by have no direction: at a degenerate edge."""


@dataclass(frozen=True, slots=True)
class Frames:
    """Tangent frames at the nodes of one or more grids, shape (…, R, C), by rows and columns.

    Attributes
    ----------
    points
        (…, R, C, 3) in model units.
    right, across
        (…, R, C, 3) orthonormal tangents: along a step by columns, and clockwise from it seen from outside.
    width
        (…, R, C): length of a step by columns, which is along `right`.
    shift, height
        (…, R, C): components of a step by rows along `right` and along `across`; the latter is positive.
    """

    points: FloatArray
    right: FloatArray
    across: FloatArray
    width: FloatArray
    shift: FloatArray
    height: FloatArray


def chart_frames(face: Face, chart: Chart, margin: int, finer: tuple[int, int] = (1, 1)) -> Frames:
    """Return the frames at the nodes of a chart's warp field; steps are texels.

    `finer` tells how many steps there are from node to node, down and to the right.
    Beyond a chart's edges its face goes on. Beyond the face's own edges, and beyond a line across which
    derivatives jump, the patches there go on as their own formulas have it, so that the field is smooth;
    where that leads astray (round a pole, or to a pole of the formula), and in the outer half of the
    outermost texels (where an edge may be a point), the derivatives are those at the nearest parameters
    inside, and points lie on the tangent.
    """
    part, row, column = face.smooth_part(chart.s0, chart.s1, chart.t0, chart.t1)
    ends = (
        (chart.s0 - row, chart.s1 - row, chart.height, part.rows),
        (chart.t0 - column, chart.t1 - column, chart.width, part.columns),
    )
    steps = [(high - low) / count for low, high, count, _ in ends]
    at = [
        low + step * (node_texels(count, margin, fine) + 0.5)
        for (low, _, count, _), step, fine in zip(ends, steps, finer, strict=True)
    ]
    inside = [
        np.clip(x, step / 2, most - step / 2) for x, step, (*_, most) in zip(at, steps, ends, strict=True)
    ]
    points, by_s, by_t = part.derivatives_grid(*inside)
    beyond = by_s * (at[0] - inside[0])[:, None, None] + by_t * (at[1] - inside[1])[:, None]
    with np.errstate(all="ignore"):
        further = part.derivatives_grid(*at)
        sound = np.isfinite(further).all(axis=(0, -1)) & _alike(by_s, further[1]) & _alike(by_t, further[2])
    found = [
        np.where(sound[..., None], out, near)
        for near, out in zip((points + beyond, by_s, by_t), further, strict=True)
    ]
    return _frames(found[0], found[1] * steps[0], found[2] * steps[1])


def node_texels(texels: int, margin: int, finer: int = 1) -> FloatArray:
    """Return where a warp field's nodes over so many texels lie, and `finer` - 1 places between two."""
    places = np.arange(finer * (node_count(texels, margin) - 1) + 1) / finer
    found: FloatArray = FIELD_STEP * (places - margin)
    return found


def _alike(inside: FloatArray, beyond: FloatArray) -> NDArray[np.bool_]:
    # Less than twice or half as long, and less than 60° apart.
    here, there = dot(inside, inside), dot(beyond, beyond)
    found: NDArray[np.bool_] = (dot(inside, beyond) > 0.5 * np.sqrt(here * there)) & (
        (there < 4 * here) & (here < 4 * there)
    )
    return found


def patch_frames(patches: Sequence[RationalPatch], nodes: int) -> Frames:
    """Return the frames on even grids of `nodes`² parameters from edge to edge of all patches."""
    # Not quite on the edges, which may be points.
    at = 0.5 + (np.linspace(0, 1, nodes) - 0.5) * 0.998
    points, by_s, by_t = np.stack([np.stack(patch.derivatives_grid(at, at)) for patch in patches], axis=1)
    return _frames(points, by_s, by_t)


def _frames(points: FloatArray, down: FloatArray, along: FloatArray) -> Frames:
    width, area = np.sqrt(dot(along, along)), np.cross(down, along)
    size = np.sqrt(dot(area, area))
    most = [x.max(axis=(-2, -1), keepdims=True) for x in (width, size)]
    good = (width > TINY * most[0]) & (size > TINY * most[1])
    if not good.all():
        nearest = from_nearest(good)
        down, along, area = (_taken(x, nearest) for x in (down, along, area))
        width, size = np.sqrt(dot(along, along)), np.sqrt(dot(area, area))
        # A patch without area has no frame at all; any will do.
        none = (width == 0) | (size == 0)
        along = np.where(none[..., None], (1.0, 0.0, 0.0), along)
        area = np.where(none[..., None], (0.0, 0.0, 1.0), area)
        width, size = np.where(none, 1.0, width), np.where(none, 1.0, size)
    right = along / width[..., None]
    across = np.cross(right, area / size[..., None])
    return Frames(points, right, across, width, dot(down, right), np.maximum(dot(down, across), 1e-300))


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the inner products of vectors (…, 3)."""
    found: FloatArray = np.einsum("...i,...i->...", a, b)
    return found


def from_nearest(good: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each node of grids (…, R, C) a good one near by in its grid: its number, row by row.

    Good nodes, and all of a grid without any, keep their own.
    """
    rows, columns = good.shape[-2:]
    number = np.broadcast_to(np.arange(rows * columns).reshape(rows, columns), good.shape).copy()
    known = good.copy()
    before = -1
    while before != (before := int(known.sum())) and before < known.size:
        for axis in (-1, -2):
            for to, of in ((np.s_[1:], np.s_[:-1]), (np.s_[:-1], np.s_[1:])):
                target, source = ((..., k) if axis == -1 else (..., k, np.s_[:]) for k in (to, of))
                fill = known[source] & ~known[target]
                number[target] = np.where(fill, number[source], number[target])
                known[target] |= fill
    return number


def _taken(values: FloatArray, number: NDArray[np.intp]) -> FloatArray:
    shape = values.shape
    flat = values.reshape(*shape[:-3], -1, shape[-1])
    return np.take_along_axis(flat, number.reshape(*shape[:-3], -1, 1), axis=-2).reshape(shape)


def within(frames: Frames, vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Project vectors on the tangent planes.

    Parameters
    ----------
    frames
        The planes.
    vectors
        (…, R, C, 3), finite.

    Returns
    -------
    ndarray
        (…, R, C, 3) unit tangents. Where next to nothing is left of a vector, for its grid, one near by
        stands in.
    ndarray
        (…, R, C) how much is left of each: 0 to 1.
    """
    size = np.sqrt(dot(vectors, vectors))
    most = size.max(axis=(-2, -1), keepdims=True)
    cosine, sine = dot(vectors, frames.right), dot(vectors, frames.across)
    left = np.where(size > 1e-12 * most, np.hypot(cosine, sine) / np.where(size > 0, size, 1), 0)
    weak = left <= 0.02 * left.max(axis=(-2, -1), keepdims=True)
    if weak.any():
        near = _taken(vectors, from_nearest(~weak))
        cosine, sine = dot(near, frames.right), dot(near, frames.across)
    length = np.hypot(cosine, sine)
    cosine, sine = np.where(length > 0, (cosine, sine), 1.0) / np.where(length > 0, length, np.sqrt(2))
    return cosine[..., None] * frames.right + sine[..., None] * frames.across, left


def aligned(tangents: FloatArray, strength: FloatArray) -> FloatArray:
    """Turn tangents round where they point against those next to them.

    From the strongest node of each grid on, signs spread first where tangents are strong and parallel: so
    they pass beside singular points, not through them, and through a line where the field is weak only where
    there is no way round.

    Parameters
    ----------
    tangents
        (…, R, C, 3) unit vectors.
    strength
        (…, R, C), see `within`.

    Returns
    -------
    ndarray
        (…, R, C, 3): the strongest node of each grid is as it was.
    """
    down = dot(tangents[..., 1:, :, :], tangents[..., :-1, :, :])
    along = dot(tangents[..., 1:, :], tangents[..., :-1, :])
    signs = np.ones(strength.shape)
    against = (down < 0).any(axis=(-2, -1)) | (along < 0).any(axis=(-2, -1))
    for grid in zip(*np.nonzero(against), strict=True) if against.ndim else [()] if against else []:
        signs[grid] = _spread_signs(down[grid], along[grid], strength[grid])
    found: FloatArray = signs[..., None] * tangents
    return found


def _spread_signs(down: FloatArray, along: FloatArray, strength: FloatArray) -> FloatArray:
    """Return signs (R, C), given the cosines between neighbours by rows and by columns."""
    rows, columns = strength.shape
    steps = (
        (-columns, np.pad(down, ((1, 0), (0, 0))).ravel().tolist()),
        (columns, np.pad(down, ((0, 1), (0, 0))).ravel().tolist()),
        (-1, np.pad(along, ((0, 0), (1, 0))).ravel().tolist()),
        (1, np.pad(along, ((0, 0), (0, 1))).ravel().tolist()),
    )
    weight = (-strength).ravel().tolist()
    signs = [0] * (rows * columns)
    queue = [(0.0, int(strength.argmax()), 1)]
    while queue:
        _, node, sign = heappop(queue)
        if signs[node]:
            continue
        signs[node] = sign
        column = node % columns
        for step, cosines in steps:
            other = node + step
            if (
                0 <= other < len(signs)
                and not signs[other]
                and (abs(step) != 1 or 0 <= column + step < columns)
            ):
                cosine = cosines[node]
                heappush(queue, (weight[other] * abs(cosine), other, -sign if cosine < 0 else sign))
    return np.array(signs, np.float64).reshape(rows, columns)
