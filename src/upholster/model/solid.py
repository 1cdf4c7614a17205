"""Whether triangles bound a printable solid: closed, without folds; and the thickness of its walls."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh as EmbreeTriangles
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.types import FloatArray, IntArray
from upholster.model.folds import crossed, folds, vertex_normals

__all__ = ["Solid", "check_solid", "shown_length", "solid_lines", "volume"]

_RAYS = 20_000
"""The most vertices from which walls are measured."""

_EVEN = 0.95
"""Walls are measured from vertices whose adjacent normals agree at least this well, 0 to 1."""

_MANY_OVERLAPS = 1e-3
"""Share of vertices: below it, single precision or grazing rays may be the cause."""

_LIFT = 1e-5
"""Depth below the surface where a ray starts, in halves of the model's size: above single precision."""


@dataclass(frozen=True, slots=True)
class Solid:
    """The findings of `check_solid`.

    Attributes
    ----------
    triangles
        Number of triangles.
    borders
        Edges with one triangle.
    crowded
        Edges with more than two.
    turned
        Edges whose two triangles run along them the same way, so that one is inside out.
    manifold
        Whether manifold3d accepts the triangles as a solid. None if it was not used.
    volume, volume_before
        In cubic model units, now and before vertices moved; None unless the surface is closed.
    folded
        Triangles that turned over when their vertices moved; the surface passes through itself there.
    fold
        (x, y, z) of one of them.
    wall, common_wall
        Least thickness along the normals and its first percentile, in model units, away from edges and folds;
        None unless the surface is closed.
    thinnest
        (x, y, z) on the surface where the wall is thinnest.
    overlaps
        Share of the measured places at which another part of the surface is inside the wall.
    """

    triangles: int
    borders: int
    crowded: int
    turned: int
    manifold: bool | None = None
    volume: float | None = None
    volume_before: float | None = None
    folded: int = 0
    fold: tuple[float, float, float] | None = None
    wall: float | None = None
    common_wall: float | None = None
    thinnest: tuple[float, float, float] | None = None
    overlaps: float = 0.0

    @property
    def is_closed(self) -> bool:
        """Whether each edge has two triangles, which run along it in opposite directions."""
        return not (self.borders or self.crowded or self.turned)


def check_solid(positions: FloatArray, triangles: IntArray, before: FloatArray | None = None) -> Solid:
    """Check triangles, and measure the solid that they bound.

    Parameters
    ----------
    positions, triangles
        (V, 3) and (T, 3): counter-clockwise seen from outside.
    before
        (V, 3): where the vertices were before a displacement. Walls are measured along the normals there, so
        that the grain of the height map does not count as a wall. By default `positions`.
    """
    before = positions if before is None else before
    borders, crowded, turned = _edge_faults(triangles, len(positions))
    if borders or crowded or turned:
        return Solid(len(triangles), borders, crowded, turned, _by_manifold(positions, triangles))
    normals, evenness = vertex_normals(before, triangles)
    folded = np.flatnonzero(folds(positions, triangles, normals))
    even = evenness > _EVEN  # at an edge or a tip the wall is not defined
    even[triangles[folded]] = False
    walls, places, overlaps = _walls(positions, triangles, normals, np.flatnonzero(even))
    least = int(walls.argmin()) if len(walls) else 0
    return Solid(
        len(triangles),
        0,
        0,
        0,
        _by_manifold(positions, triangles),
        volume(positions, triangles),
        volume(before, triangles),
        len(folded),
        _point(positions[triangles[folded[0]]].mean(axis=0)) if len(folded) else None,
        float(walls[least]) if len(walls) else None,
        float(np.percentile(walls, 1)) if len(walls) else None,
        _point(places[least]) if len(walls) else None,
        overlaps,
    )


def solid_lines(solid: Solid, metres: float | None) -> list[str]:
    """Describe the findings of `check_solid`, one per line.

    Parameters
    ----------
    solid
        The findings.
    metres
        Length of a model unit in metres, to show millimetres. None shows model units.
    """
    count = number_of(solid.triangles, "triangle")
    if not solid.is_closed:
        faults = (
            (solid.borders, "with a triangle on one side only"),
            (solid.crowded, "with more than two triangles"),
            (solid.turned, "where one triangle is inside out"),
        )
        listed = ", ".join(f"{number_of(number, 'edge')} {what}" for number, what in faults if number)
        return [f"{count}, which are not a solid: {listed}"]
    assert solid.volume is not None
    assert solid.volume_before is not None
    lines = [f"{count}, a closed solid of {_shown_volume(solid.volume, metres)}"]
    if solid.volume != solid.volume_before:
        lines[0] += f" ({_shown_volume(solid.volume_before, metres)} before it was displaced)"
    if solid.manifold is False:
        lines.append("manifold3d does not accept it as a solid")
    if solid.volume < 0:
        lines.append("its triangles face inward: it is inside out, and was displaced inward")
    if solid.folded and solid.fold is not None:
        place = _shown_place(solid.fold, metres)
        lines.append(
            f"it passes through itself: {number_of(solid.folded, 'triangle')} turned over, one at {place}"
        )
    if solid.overlaps > _MANY_OVERLAPS:
        lines.append(f"parts of it overlap: seen from {solid.overlaps:.1%} of its vertices")
    if solid.wall is not None and solid.common_wall is not None and solid.thinnest is not None:
        lines.append(
            f"thinnest wall {shown_length(solid.wall, metres)} at {_shown_place(solid.thinnest, metres)}; "
            f"99% of it is thicker than {shown_length(solid.common_wall, metres)}"
        )
    return lines


def shown_length(length: float, metres: float | None) -> str:
    """Return a length as text: in millimetres if the model's unit is known."""
    return f"{length:.3g}" if metres is None else f"{length * metres * 1000:.3g} mm"


def _shown_place(place: tuple[float, float, float], metres: float | None) -> str:
    scale, unit = (1.0, "") if metres is None else (1000 * metres, " mm")
    return f"({', '.join(f'{scale * number:.3g}' for number in place)}){unit}"


def _shown_volume(size: float, metres: float | None) -> str:
    return f"volume {size:.4g}" if metres is None else f"{size * (100 * metres) ** 3:.4g} cm³"


def volume(positions: FloatArray, triangles: IntArray) -> float:
    """Return the volume that closed triangles (T, 3) bound; below 0 if they are inside out."""
    a, b, c = (positions - positions.mean(axis=0))[triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def _point(place: FloatArray) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z


def _edge_faults(triangles: IntArray, vertices: int) -> tuple[int, int, int]:
    """Return how many edges have one triangle, more than two, and two that run the same way."""
    first = triangles.astype(np.int64)
    last = np.roll(first, -1, axis=1)
    key = (np.minimum(first, last) * vertices + np.maximum(first, last)).ravel()
    # The lowest bit is the direction of a side along its edge.
    key = np.sort(key * 2 + (first < last).ravel())
    edge = key >> 1
    starts = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]]))
    counts = np.diff(np.append(starts, len(edge)))
    pairs = starts[counts == 2]
    return (
        int((counts == 1).sum()),
        int((counts > 2).sum()),
        int((key[pairs] == key[pairs + 1]).sum()),
    )


def _by_manifold(positions: FloatArray, triangles: IntArray) -> bool:
    from manifold3d import Error, Manifold, Mesh64

    # manifold3d does not accept read-only arrays.
    mesh = Mesh64(positions.astype(np.float64, order="C"), triangles.astype(np.uint64, order="C"))
    found = Manifold(mesh)
    return bool(found.status() == Error.NoError and not found.is_empty())


def _walls(
    positions: FloatArray, triangles: IntArray, normals: FloatArray, usable: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray, float]:
    """Measure walls from some of the usable vertices against normals, (V, 3).

    Returns thicknesses (n,), places (n, 3), and the share of vertices whose ray first meets a triangle from
    outside: parts overlap there, and there is no wall.
    """
    if not len(usable):
        return np.empty(0), np.empty((0, 3)), 0.0
    chosen = usable[np.linspace(0, len(usable) - 1, min(_RAYS, len(usable))).astype(np.int64)]
    low, high = positions.min(axis=0), positions.max(axis=0)
    middle, radius = (low + high) / 2, float((high - low).max()) / 2 or 1.0
    points = ((positions - middle) / radius).astype(np.float32)
    scene = EmbreeScene()
    geometry = EmbreeTriangles(scene, points, np.ascontiguousarray(triangles, np.int32))
    inward = (-normals[chosen]).astype(np.float32)
    hits = scene.run(points[chosen] + inward * np.float32(_LIFT), inward, query="INTERSECT", output=1)
    del geometry  # the scene needed it until its last query
    met = np.flatnonzero(hits["primID"] >= 0)
    facing = crossed(positions, triangles[hits["primID"][met]])
    leaves = (facing * inward[met]).sum(axis=1) >= 0
    grazed = (triangles[hits["primID"][met]] == chosen[met, None]).any(axis=1)  # next to its start
    measured = met[leaves & ~grazed]
    walls = (hits["tfar"][measured].astype(np.float64) + _LIFT) * radius
    return walls, positions[chosen[measured]], float((~leaves & ~grazed).sum()) / len(chosen)
