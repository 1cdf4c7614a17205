"""Vertices far away from all others, as stray ones in scans, and the share of the surface at them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.types import FloatArray
from upholster.charts.layout import face_areas
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.geometry.patches.surface import Surface

__all__ = ["FarVertices", "blamed_on_far", "far_vertices", "place_in_words"]

_GAP = 10.0
"""No vertex is between the others and the far ones: these are so many times as far away from the middle."""

_FAR = 100.0
"""The farthest vertex is at least so many times as far away from the middle as all those before the gap."""

_LISTED = 3
"""Number of far vertices that are listed."""


@dataclass(frozen=True, eq=False, slots=True)
class FarVertices:
    """Vertices far away from all others.

    Attributes
    ----------
    places
        (n, 3) their positions, the nearest first.
    others
        Number of the other vertices.
    share
        Share of the surface's area whose triangles, or faces, have such a vertex.
    kind
        "vertex" or "control point".
    """

    places: FloatArray
    others: int
    share: float
    kind: str

    @property
    def words(self) -> str:
        """What is far, where, and how much of the surface is there, in one sentence."""
        count = len(self.places)
        kinds = "vertices" if self.kind == "vertex" else f"{self.kind}s"
        listed = ", ".join(map(place_in_words, self.places[:_LISTED])) + " …" * (count > _LISTED)
        return (
            f"{number_of(count, self.kind, kinds)} {'is' if count == 1 else 'are'} far away from the "
            f"{self.others:,} others, at {listed}, with {100 * self.share:.3g} % of the surface"
        )


def far_vertices(surface: AnySurface | TriangleMesh) -> FarVertices | None:
    """Return the vertices, or control points, far away from all others; None if there are none.

    Their distance from the middle, the median of all triangles' corners, is at least 10 times that of any
    other vertex. At least half of these corners are others; the farthest is 100 times as far as they are.
    """
    mesh = surface.mesh if isinstance(surface, MeshSurface) else surface
    if isinstance(mesh, Surface):
        nets = [patch.control_points.reshape(-1, 3) for patch in mesh.patches]
        faces = [mesh.place(number)[0] for number in range(len(nets))]
        return _found(np.concatenate(nets), np.repeat(faces, [len(net) for net in nets]), mesh)
    owner = np.repeat(np.arange(len(mesh.triangles)), 3)
    return _found(mesh.corners.reshape(-1, 3), owner, mesh)


def blamed_on_far(mesh: TriangleMesh) -> str:
    """Return the end of a refusal that advises to remove far vertices; empty if there are none."""
    far = far_vertices(mesh)
    if far is None:
        return ""
    return (
        f"; or without stray vertices, such as that at {place_in_words(far.places[-1])}: "
        f"{100 * far.share:.3g} % of the surface is there"
    )


def place_in_words(place: FloatArray) -> str:
    """Return a point (3,) in words."""
    return f"({', '.join(f'{x + 0.0:.6g}' for x in place)})"


def _found(
    points: FloatArray, owner: NDArray[np.intp], surface: Surface | TriangleMesh
) -> FarVertices | None:
    """Return which of the points (n, 3) are far; `owner` (n,) is the triangle or face of each."""
    middle = np.median(points, axis=0)
    away = np.linalg.norm(points - middle, axis=1)
    limit = _limit(away)
    if limit is None:
        return None
    far = away > limit
    places, others = np.unique(points[far], axis=0), np.unique(points[~far], axis=0)
    order = np.argsort(np.linalg.norm(places - middle, axis=1), kind="stable")
    on_patches = isinstance(surface, Surface)
    areas = face_areas(surface) if isinstance(surface, Surface) else surface.areas
    share = float(areas[np.bincount(owner, far) > 0].sum() / max(float(areas.sum()), 1e-300))
    return FarVertices(places[order], len(others), share, "control point" if on_patches else "vertex")


def _limit(away: FloatArray) -> float | None:
    """Return the greatest distance before the gap; None if no distance (n,) is far."""
    order = np.sort(away)
    rest = order[len(order) // 2 :]
    gaps = np.flatnonzero((rest[1:] >= _GAP * rest[:-1]) & (rest[:-1] > 0))
    if not len(gaps) or not rest[-1] >= _FAR * rest[gaps[0]]:
        return None
    return float(rest[gaps[0]])
