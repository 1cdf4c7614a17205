"""Following a surface straight on from borders, in plain NumPy: the oracle of `_flat_kernels`."""

from typing import NamedTuple

import numpy as np

from upholster.charts.directions.flats import FaceBorder
from upholster.geometry import TriangleMesh


class _Walk(NamedTuple):
    """Ways straight over the surface: which, where, whereto, how far yet, and the edge to be crossed next.

    `met` is triangle · 3 + edge beyond it, −1 for none; `line` runs along it, its triangle to the left.
    """

    number: np.ndarray
    at: np.ndarray
    way: np.ndarray
    left: np.ndarray
    met: np.ndarray
    line: np.ndarray

    def only(self, these: np.ndarray) -> "_Walk":
        """Return some of the ways."""
        number, at, way, left = self.number[these], self.at[these], self.way[these], self.left[these]
        return _Walk(number, at, way, left, self.met[these], self.line[these])


def plain_sharp(
    mesh: TriangleMesh,
    own_normals: np.ndarray,
    border: FaceBorder,
    planes: np.ndarray,
    width: np.ndarray,
    least: float,
) -> np.ndarray:
    """Return at which edges of a border (B,) a face ends sharply, following all ways at a time."""
    sharp = np.zeros(len(border.face), np.bool_)
    way = np.cross(border.line, own_normals[border.triangle])
    walk = _Walk(
        np.arange(len(sharp)),
        mesh.corners[border.triangle, border.edge] + 0.5 * border.line,
        way / np.maximum(_lengths(way), 1e-300)[:, None],
        width[border.face],
        mesh.neighbours[border.triangle, border.edge],
        border.line,
    )
    for _ in range(256):
        normals, own = own_normals[walk.met // 3], planes[border.face[walk.number]]
        ends = (walk.met < 0) | (np.einsum("ij,ij->i", normals, own) <= least)
        sharp[walk.number[ends]] = True
        walk = walk.only(~ends)
        walk = _crossed(mesh, own_normals, walk._replace(way=_unfolded(walk, normals[~ends])))
        walk = walk.only(walk.left > 0)
        if not len(walk.number):
            break
    return sharp


def _unfolded(walk: _Walk, normals: np.ndarray) -> np.ndarray:
    """Return ways (N, 3) in the planes, of unit normals (N, 3), beyond the edges that they cross."""
    unit = walk.line / np.maximum(_lengths(walk.line), 1e-300)[:, None]
    along = np.einsum("ij,ij->i", walk.way, unit)
    across = np.sqrt(np.maximum(1 - along**2, 0))
    return np.asarray(along[:, None] * unit + across[:, None] * np.cross(unit, normals))


def _crossed(mesh: TriangleMesh, own_normals: np.ndarray, walk: _Walk) -> _Walk:
    """Return ways as they go on from the other side of the triangles in which they are."""
    triangle, entered = np.divmod(walk.met, 3)
    corners, row = mesh.corners[triangle], np.arange(len(triangle))
    best, leaves = np.full(len(row), np.inf), (entered + 1) % 3
    for turn in (1, 2):
        edge = (entered + turn) % 3
        start = corners[row, edge]
        inward = np.cross(own_normals[triangle], corners[row, (edge + 1) % 3] - start)
        speed = -np.einsum("ij,ij->i", walk.way, inward)
        away = np.maximum(np.einsum("ij,ij->i", walk.at - start, inward), 0.0)
        after = np.where(speed > 0, away / np.where(speed > 0, speed, 1.0), np.inf)
        leaves = np.where(after < best, edge, leaves)
        best = np.minimum(best, after)
    step = np.where(np.isfinite(best), best, walk.left)
    line = corners[row, (leaves + 1) % 3] - corners[row, leaves]
    at, met = walk.at + step[:, None] * walk.way, mesh.neighbours[triangle, leaves]
    return _Walk(walk.number, at, walk.way, walk.left - step, met, line)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((vectors**2).sum(axis=1)))
