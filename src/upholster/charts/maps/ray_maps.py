"""Maps computed with short rays: edges, hollows, and hidden places.

References
----------
I. Wald et al.: Embree, SIGGRAPH 2014. T. Duff et al.: Building an orthonormal basis, revisited, JCGT 6, 2017.
"""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh as EmbreeTriangles
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from upholster.base.lengths import Length
from upholster.base.types import FloatArray, IntArray
from upholster.charts.maps.coarse_values import CLASSES, SurfacePoints, coarse_cells, spread_over_steps
from upholster.charts.maps.map_ground import AtSteps, MapGround
from upholster.charts.maps.map_source import MapSource
from upholster.charts.maps.shapes import length_on
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.parallel import check_cancelled

__all__ = ["Curvature", "Occlusion"]

_CURVATURE_REACH = 0.03
_OCCLUSION_REACH = 1 / 3
"""Default lengths of rays, as shares of the model's size."""

_RAYS = 16
"""Rays from each point; each class of points has different ones."""

_BATCH = 1 << 14
"""Number of points whose rays are traced together."""

_LIFT = 1e-4
"""Distance from the surface at which rays start, as a share of the model's size: enough for single
precision."""

_WALL = -0.7
"""Cosine between the normals of a point and of the triangle opposite: below this, that is a wall's other
side."""


@dataclass(frozen=True)
class Curvature(MapSource):
    """½ where a surface is flat, towards 1 at edges and ridges, towards 0 in hollows.

    The value is ½, plus the share of inward rays that meet the surface from within, minus the share of
    outward rays that meet it. Rays are cosine-weighted about the normal and end at the reach. At a right
    angle the value is 1 or 0, fading over the reach. The other side of a thin wall is not an edge.

    Attributes
    ----------
    reach
        None: 3 % of the model's size.
    """

    reach: Length | None = None

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        mesh = ground.charted.mesh
        reach = _CURVATURE_REACH * mesh.size
        if self.reach is not None:
            reach = length_on(ground, self.reach, "reach")
        scene = _Scene(mesh)

        def evaluate(points: SurfacePoints) -> FloatArray:
            hollow = scene.shares(points, reach, 1.0)
            edge = scene.shares(points, reach, -1.0)
            return np.clip(0.5 + edge - hollow, 0.0, 1.0)

        cells = coarse_cells(ground.charted)
        return spread_over_steps(cells, evaluate)


@dataclass(frozen=True)
class Occlusion(MapSource):
    """1 where a surface is open, 0 where it is hidden: the share of outward rays that meet nothing.

    Rays are cosine-weighted about the normal.

    Attributes
    ----------
    reach
        Length of rays; None: a third of the model's size.
    """

    reach: Length | None = None

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        mesh = ground.charted.mesh
        reach = _OCCLUSION_REACH * mesh.size
        if self.reach is not None:
            reach = length_on(ground, self.reach, "reach")
        scene = _Scene(mesh)
        cells = coarse_cells(ground.charted)
        return spread_over_steps(cells, lambda points: 1.0 - scene.shares(points, reach, 1.0))


class _Scene:
    """Triangles that rays may meet, moved and scaled so that the model's size is 1."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._normals = mesh.flat_normals
        self._middle, self._size = mesh.box.mean(axis=0), mesh.size or 1.0
        self._scene = EmbreeScene()
        # It has to live as long as the scene is in use.
        self._geometry = EmbreeTriangles(
            self._scene, self._scaled(mesh.positions), np.array(mesh.triangles, np.int32)
        )

    def _scaled(self, positions: FloatArray) -> NDArray[np.float32]:
        scaled: NDArray[np.float32] = ((positions - self._middle) / self._size).astype(np.float32)
        return scaled

    def shares(self, points: SurfacePoints, reach: float, side: float) -> FloatArray:
        """Return the share of rays from each point (n,) that meet something within reach.

        On side 1 rays go outward, and may meet anything. On side −1 they go inward, and those count that
        leave the surface at an edge.
        """
        out = np.empty(len(points.kind))
        for first in range(0, len(out), _BATCH):
            check_cancelled()
            batch = slice(first, first + _BATCH)
            normals = side * points.normals[batch]
            directions = _hemispheres(normals, points.kind[batch])
            starts = self._scaled(points.positions[batch] + _LIFT * self._size * normals)
            origins = np.repeat(starts, _RAYS, axis=0)
            rays = directions.reshape(-1, 3).astype(np.float32)
            reaches = np.full(len(rays), reach / self._size, np.float32)
            if side > 0:
                met = self._scene.run(origins, rays, dists=reaches, query="OCCLUDED") >= 0
            else:
                hit = self._scene.run(origins, rays, dists=reaches, query="INTERSECT")
                met = self._is_edge(hit, rays, np.repeat(points.normals[batch], _RAYS, axis=0))
            out[batch] = met.reshape(-1, _RAYS).mean(axis=1)
        return out

    def _is_edge(self, hit: IntArray, rays: NDArray[np.float32], normals: FloatArray) -> NDArray[np.bool_]:
        # Which rays meet a triangle from within that is not the other side of a wall.
        there = self._normals[np.maximum(hit, 0)]
        leaves = (there * rays).sum(axis=1) > 0
        found: NDArray[np.bool_] = (hit >= 0) & leaves & ((there * normals).sum(axis=1) > _WALL)
        return found


def _hemispheres(normals: FloatArray, kind: NDArray[np.int64]) -> FloatArray:
    """Return cosine-weighted directions about normals (n, 3): (n, rays, 3).

    All classes of points together share one evenly distributed spiral; each class has every sixteenth
    direction.
    """
    k = np.arange(_RAYS) * CLASSES + kind[:, None]
    share = (k + 0.5) / (_RAYS * CLASSES)
    angle = 2 * np.pi * ((k * (np.sqrt(5) - 1) / 2) % 1.0)
    x, y, z = np.sqrt(share) * np.cos(angle), np.sqrt(share) * np.sin(angle), np.sqrt(1 - share)
    across, along = _frames(normals)
    turned: FloatArray = (
        x[..., None] * across[:, None] + y[..., None] * along[:, None] + z[..., None] * normals[:, None]
    )
    return turned


def _frames(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors at right angles to each normal and to each other (Duff et al.)."""
    x, y, z = normals.T
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    across = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return across, np.stack([b, sign + y * y * a, -y], axis=1)
