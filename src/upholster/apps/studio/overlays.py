"""Lines over a model that show how it is covered."""

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.covering.request import Request
from upholster.synthesis.quilt.scene import Scene

__all__ = ["KINDS", "segments"]

_ARROWS, _SQUARES = 3000, 800
"""Number of symbols on a model, about."""

_RAISED = 0.002
"""Height of lines over the surface, as a share of the model's size."""

_STAR = 0.02
"""Half the length of a star's lines, as a share of the model's size."""


def segments(request: Request, kind: str) -> FloatArray:
    """Return line segments (n, 2, 3) of the request of one sample.

    Parameters
    ----------
    request
        The request; its scene is made here if it is not yet.
    kind
        "seams": where charts meet; "direction": the direction of the sample's rows; "density": squares of
        equally many texels; "singular": stars where no direction is right.

    Raises
    ------
    InputError
        For another kind, or if the method does not provide it.
    """
    if kind not in KINDS:
        raise InputError(f"overlay is {kind!r}; allowed: {', '.join(KINDS)}")
    scene = request.scene
    if not isinstance(scene, Scene):
        raise InputError(f"overlay {kind} is for method quilt on a surface")
    return KINDS[kind](scene)


def _seams(scene: Scene) -> FloatArray:
    charted = scene.charted
    triangle, edge = charted.seams[:, :2].T
    ends = np.stack([edge, (edge + 1) % 3], axis=1)
    found: FloatArray = charted.mesh.corners[triangle[:, None], ends] + _raised(charted, triangle)[:, None]
    return found


def _direction(scene: Scene) -> FloatArray:
    charted = scene.charted
    chosen, apart = _evenly(charted, _ARROWS)
    along = scene.vectors[chosen].mean(axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    middle = charted.mesh.corners[chosen].mean(axis=1) + _raised(charted, chosen)
    return np.stack([middle - 0.35 * apart * along, middle + 0.35 * apart * along], axis=1)


def _density(scene: Scene) -> FloatArray:
    charted = scene.charted
    chosen, apart = _evenly(charted, _SQUARES)
    corners, places = charted.mesh.corners[chosen], charted.places[chosen]
    sides, steps = corners[:, 1:] - corners[:, :1], places[:, 1:] - places[:, :1]
    areas = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 0, 1] * steps[:, 1, 0]
    seen = np.abs(areas) > 1e-12
    # One step down and one step to the right on the chart, as vectors in space.
    step = np.linalg.solve(steps[seen], sides[seen])
    length = float(np.median(np.linalg.norm(step, axis=2)))
    down, right = np.moveaxis(0.25 * apart / length * step, 1, 0)
    middle = corners[seen].mean(axis=1) + _raised(charted, chosen[seen])
    around = [middle - down - right, middle - down + right, middle + down + right, middle + down - right]
    square = np.stack(around, axis=1)
    return np.stack([square, np.roll(square, -1, axis=1)], axis=2).reshape(-1, 2, 3)


def _singular(scene: Scene) -> FloatArray:
    places = np.zeros((0, 3)) if scene.field is None else scene.field.places
    ways = _STAR * scene.charted.mesh.size * np.array([*np.eye(3), [0.58, 0.58, 0.58], [0.58, -0.58, -0.58]])
    return np.stack([places[:, None] - ways, places[:, None] + ways], axis=2).reshape(-1, 2, 3)


KINDS = {"seams": _seams, "direction": _direction, "density": _density, "singular": _singular}


def _evenly(charted: ChartedSurface, count: int) -> tuple[IntArray, float]:
    """Return about this many triangles, spread evenly by area, and the distance between them."""
    covered = np.flatnonzero(charted.chart >= 0).astype(np.int32)
    areas = charted.mesh.areas[covered]
    total = float(areas.sum())
    # Where the running sum of areas passes a multiple.
    passed = np.floor(np.cumsum(areas) / total * count).astype(np.int64)
    return covered[np.diff(passed, prepend=-1) > 0], float(np.sqrt(total / count))


def _raised(charted: ChartedSurface, triangles: IntArray) -> FloatArray:
    found: FloatArray = _RAISED * charted.mesh.size * charted.mesh.flat_normals[triangles]
    return found
