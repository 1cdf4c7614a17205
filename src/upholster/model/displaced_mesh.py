"""Displaced meshes: a model's mesh, refined where the height map requires it, with its vertices moved.

Vertices of a model's mesh at the same place are merged, so the result is as watertight as the model. Edges
are bisected until straight lines between their ends follow the height map (`_displace_kernels.refine`).
Whether an edge is cut depends only on the edge, so adjacent triangles always fit. Then vertices move along
the normals by the height there, on a seam by the mean of both charts' heights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upholster.base.conditions import Condition
from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError, check_whole
from upholster.base.types import FloatArray, IntArray, frozen_array
from upholster.charts.tessellation.mesh import Mesh
from upholster.geometry.components import connected
from upholster.geometry.meshes.triangle_mesh import welded
from upholster.model._displace_kernels import (
    Growing,
    HeightField,
    measure_spacing,
    move_vertices,
    refine_triangles,
)
from upholster.model.folds import held_back
from upholster.model.heights import height_levels
from upholster.quilt.model import Texels

__all__ = ["CREASE", "MOST_TRIANGLES", "DisplacedMesh", "displaced", "kept_box", "plain_solid"]

MOST_TRIANGLES = 8_000_000

CREASE = 60.0
"""Degrees between two faces above which their edge is a crease: normals are not smoothed across it."""

_LEAST_COSINE = 0.5
"""Least cosine between a vertex's normal and its triangles' for the full mitre; below it, it goes no
farther."""

_TOLERANCE = 0.02
"""Default tolerance of edges against the height map, as a share of the amount."""

_FALLOFF = 2.0
"""Distance from the kept region over which the displacement sets in, as a multiple of the amount."""


@dataclass(frozen=True, eq=False)
class DisplacedMesh(Shown):
    """Triangles without texture; adjacent triangles share their vertices.

    Attributes
    ----------
    positions
        (V, 3) float64, read-only, in model units.
    triangles
        (T, 3) int32, read-only: counter-clockwise seen from outside.
    before
        (V, 3): the vertices' original positions.
    error
        Greatest remaining distance, in model units, between a straight edge and the height map, if the limit
        of triangles was reached; 0 if the map is followed.
    held
        Number of vertices that moved less than they should, so that the surface does not fold over.
    """

    positions: FloatArray
    triangles: IntArray
    before: FloatArray = field(repr=False)
    error: float = 0.0
    held: int = 0

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.positions, self.triangles, self.before):
            frozen_array(array)

    def __repr__(self) -> str:
        return on_a_line(self, {"triangles": len(self.triangles), "vertices": len(self.positions)})


Array = TypeVar("Array", bound=NDArray[Any])


class _Base(NamedTuple):
    """A model's mesh before refinement, with merged vertices."""

    positions: FloatArray
    corners: IntArray
    places: NDArray[np.float32]
    normals: NDArray[np.float32]
    chart: IntArray
    edges: IntArray
    next_side: IntArray


def displaced(
    mesh: Mesh,
    height: Texels,
    *,
    amount: float,
    triangles: int = 500_000,
    keep: NDArray[np.float64] | None = None,
    mid: float = 0.0,
    tolerance: float | None = None,
) -> DisplacedMesh:
    """Refine a mesh until it can follow a height map, and move its vertices outward by it.

    Vertices move along normals that are smooth except across creases of more than 60°. At creases and at the
    surface's borders, triangles stay connected. In concave corners vertices move less where triangles would
    fold over, see `upholster.model.folds`.

    Parameters
    ----------
    mesh
        The surface. Triangles with all corners at one place of a chart are without texture, and do not move.
    height
        Heights, or colours, whose luminance is used: see `upholster.model.heights.height_values`.
    amount
        Displacement at height 1, in model units; negative is inward.
    triangles
        Greatest number of triangles, up to 8,000,000.
    keep
        The box that does not move, (2, 3): its least and its greatest corner, which may be infinite; see
        `kept_box`. Around it the displacement sets in over twice the amount.
    mid
        The height that does not move, 0 to 1.
    tolerance
        Greatest distance of an edge from the height map, in model units: by default a fiftieth of the amount.

    Raises
    ------
    InputError
        If a number is out of range, or the mesh has more triangles already.

    References
    ----------
    M.-C. Rivara: New longest-edge algorithms for the refinement and/or improvement of unstructured
    triangulations. Numerical Methods in Engineering 40, 1997.
    G. Thürmer, C. Wüthrich: Computing vertex normals from polygonal facets. JGT 3, 1998. (Angles as weights.)
    """
    if not np.isfinite(amount):
        raise InputError(f"displace is {amount}; allowed: a finite number")
    if not 0 <= mid <= 1:
        raise InputError(f"mid_level is {mid:g}; allowed: 0 to 1")
    most = check_whole("triangles", triangles, 1, MOST_TRIANGLES)
    base = _welded_base(mesh)
    if len(base.corners) > most:
        raise InputError(
            f"triangles is {most:,}; allowed: at least {len(base.corners):,}, which the model has before it "
            "is displaced"
        )
    values, levels, step = height_levels(height, most)
    box = np.array([[np.inf] * 3, [-np.inf] * 3]) if keep is None else np.asarray(keep, np.float64)
    heights = HeightField(
        values, levels, float(step), float(amount), float(mid), box, max(_FALLOFF * abs(amount), 1e-30)
    )
    limit = _TOLERANCE * abs(amount) if tolerance is None else tolerance
    growing, counts = _with_room(base, most)
    error = refine_triangles(growing, heights, float(limit), most, counts)
    vertices, count, _ = counts.tolist()
    spacing = np.full(vertices, np.finfo(np.float32).max, np.float32)
    measure_spacing(growing, count, spacing)
    positions = np.empty((vertices, 3))
    move_vertices(growing, heights, counts, spacing, np.zeros((vertices, 7)), positions)
    corners, before = growing.corners[:count].copy(), growing.positions[:vertices].copy()
    positions, held = held_back(positions, before, corners)
    return DisplacedMesh(positions, corners, before, float(error), int(held.sum()))


def plain_solid(mesh: Mesh) -> DisplacedMesh:
    """Return a model's mesh with merged vertices, for printing without a displacement."""
    base = _welded_base(mesh)
    return DisplacedMesh(base.positions, base.corners, base.positions)


def kept_box(conditions: Sequence[Condition], metres_per_unit: float | None) -> FloatArray:
    """Return the box in which all conditions hold, (2, 3): least and greatest corner, in model units.

    Raises
    ------
    InputError
        If they hold nowhere, or a bound has a unit and the model's unit is not known.
    """
    box = np.array([[-np.inf] * 3, [np.inf] * 3])
    for condition in conditions:
        bound = condition.bound.in_units(metres_per_unit, name="keep's bound")
        column = box[:, condition.axis]
        if condition.below:
            column[1] = min(column[1], bound)
        else:
            column[0] = max(column[0], bound)
    if (box[0] > box[1]).any():
        axis = "xyz"[int(np.argmax(box[0] > box[1]))]
        raise InputError(f"keep's conditions on {axis} hold nowhere together; allowed: some that do")
    return box


def _welded_base(mesh: Mesh) -> _Base:
    """Merge a mesh's vertices, and find its edges and its corners' normals."""
    positions, vertex = welded(mesh.positions)
    split = mesh.all_triangles()
    corners = vertex[split]
    whole = (corners != np.roll(corners, -1, axis=1)).all(axis=1)  # −0 and 0 count as equal only here
    split, corners = split[whole], np.ascontiguousarray(corners[whole], np.int32)
    used, inverse = np.unique(corners, return_inverse=True)
    positions, corners = positions[used], inverse.reshape(-1, 3).astype(np.int32)
    edges, next_side = _rings(corners, len(positions))
    places = mesh.places[split].astype(np.float32)
    textured = (places != places[:, :1]).any(axis=(1, 2))
    return _Base(
        positions,
        corners,
        places,
        _corner_normals(positions, corners, next_side),
        np.where(textured, mesh.chart[split[:, 0]], -1).astype(np.int32),
        edges,
        next_side,
    )


def _rings(corners: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """Return the edge of each side, (T, 3), and the next side of the same edge, (3·T,), in a ring."""
    first = corners.astype(np.int64)
    last = np.roll(first, -1, axis=1)
    keys = (np.minimum(first, last) * vertices + np.maximum(first, last)).ravel()
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    begins = np.concatenate([[True], ranked[1:] != ranked[:-1]])
    starts = np.flatnonzero(begins)
    following = np.arange(1, len(order) + 1)
    following[np.append(starts[1:], len(order)) - 1] = starts
    next_side = np.empty(len(order), np.int32)
    next_side[order] = order[following]
    edges = np.empty(len(order), np.int32)
    edges[order] = np.cumsum(begins) - 1
    return edges.reshape(-1, 3), next_side


def _corner_normals(positions: FloatArray, corners: IntArray, next_side: IntArray) -> NDArray[np.float32]:
    """Return normals of triangles' corners, (T, 3, 3), smoothed over edges that are not creases.

    Each is the mean over the triangles around its vertex, up to creases, weighted by their angles there. It
    is scaled so that its mean component along their normals is 1. So flat triangles move by the full height,
    and where the surface is smooth it is a unit vector.
    """
    points = positions[corners]
    sides = np.roll(points, -1, axis=1) - points
    crossed = np.cross(sides[:, 0], -sides[:, 2])
    area = np.linalg.norm(crossed, axis=1, keepdims=True)
    flat = np.divide(crossed, area, out=np.zeros_like(crossed), where=area > 0)
    one = np.arange(len(next_side))
    two = next_side[one]
    smooth = (one < two) & (next_side[two] == one)
    one, two = one[smooth], two[smooth]
    opposed = corners[one // 3, one % 3] != corners[two // 3, two % 3]  # same orientation
    smooth = opposed & ((flat[one // 3] * flat[two // 3]).sum(axis=1) > np.cos(np.radians(CREASE)))
    one, two = one[smooth], two[smooth]
    after_one, after_two = one // 3 * 3 + (one + 1) % 3, two // 3 * 3 + (two + 1) % 3
    pairs = np.concatenate([np.stack([one, after_two], axis=1), np.stack([after_one, two], axis=1)])
    group = connected(corners.size, pairs)
    before = -np.roll(sides, 1, axis=1)
    across = np.linalg.norm(np.cross(sides, before), axis=2)
    angles = np.arctan2(across, (sides * before).sum(axis=2))
    weighted = (angles[:, :, None] * flat[:, None]).reshape(-1, 3)
    sums = np.stack([np.bincount(group, weighted[:, axis], corners.size) for axis in range(3)], axis=1)
    squares = (sums**2).sum(axis=1, keepdims=True)
    weights = np.bincount(group, (angles * (area[:, 0] > 0)[:, None]).ravel(), corners.size)[:, None]
    # The mean's direction divided by its mean cosine, which is its length; at most twice a unit vector.
    reach = np.maximum(squares, _LEAST_COSINE * weights * np.sqrt(squares))
    normals = np.divide(sums * weights, reach, out=np.zeros_like(sums), where=reach > 0)
    return np.asarray(normals[group].reshape(-1, 3, 3), np.float32)


def _with_room(base: _Base, most: int) -> tuple[Growing, NDArray[np.int64]]:
    """Return arrays with room for this many triangles, and the numbers of vertices, triangles and edges."""
    count, edges = len(base.corners), int(base.edges.max()) + 1
    more = most - count
    vertices = len(base.positions)
    side = np.full(edges + 3 * more, -1, np.int32)
    side[base.edges.ravel()] = np.arange(3 * count, dtype=np.int32)
    growing = Growing(
        _room(base.positions, more),
        _room(base.corners, more),
        _room(base.places, more),
        _room(base.normals, more),
        _room(base.chart, more),
        _room(base.edges, more),
        _room(base.next_side, 3 * more),
        side,
        np.empty(len(side), np.float32),
        np.empty(len(side), np.int32),
    )
    return growing, np.array([vertices, count, edges], np.int64)


def _room(array: Array, extra: int) -> Array:
    """Return an array with room for more rows."""
    out = np.empty((len(array) + extra, *array.shape[1:]), array.dtype)
    out[: len(array)] = array
    return cast(Array, out)
