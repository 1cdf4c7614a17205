"""Each triangle's plane, and how directions are carried over edges."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts.directions._kernels import regions
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["PlaneFrames", "plane_frames", "power", "root"]

_SLIVER = 1e-5
"""The two shorter edges of a triangle together exceed its longest edge by at least this share of it."""

_HEAVIEST = 1e4
"""Upper limit of the edges' weights, which have no unit: about 1 between well-shaped triangles."""


@dataclass(frozen=True, slots=True)
class PlaneFrames:
    """Frames of a mesh's triangles, and the edges over which a field is continuous.

    A direction in a triangle is a complex number: 1 runs along `x`, i along `y` = normal × x.

    Attributes
    ----------
    x, y, normals
        (T, 3) unit vectors. A degenerate triangle takes the normal of its neighbours.
    along
        (T, 3) complex, of size 1: the triangles' edges as directions.
    areas
        (T,) positive.
    first, second
        (E,) the triangles adjacent to each edge over which the field is continuous.
    carried
        (E,) complex, of size 1: a direction in `first` times this is the same direction in `second` unfolded.
    weights
        (E,) the cost of a jump there: length of the edge over distance of the triangles' centroids.
    across, edges
        (T, 3) the triangle across each edge over which the field is continuous, −1 for none; and the edge's
        number in the previous four arrays.
    part, parts
        (T,) the number of each triangle's connected piece, and how many pieces there are.
    """

    x: FloatArray
    y: FloatArray
    normals: FloatArray
    along: ComplexArray
    areas: FloatArray
    first: IntArray
    second: IntArray
    carried: ComplexArray
    weights: FloatArray
    across: IntArray
    edges: IntArray
    part: IntArray
    parts: int

    def numbers(self, vectors: FloatArray) -> ComplexArray:
        """Return vectors (T, 3), projected on the planes, as complex numbers (T,)."""
        found = np.empty(len(vectors), np.complex128)
        found.real = np.einsum("ij,ij->i", vectors, self.x)
        found.imag = np.einsum("ij,ij->i", vectors, self.y)
        return found

    def mean_normals(self, corners: IntArray, count: int) -> FloatArray:
        """Return unit normals (count, 3), zero where no triangle has a number in `corners` (T, 3).

        They are area-weighted means over the triangles that have the number.
        """
        normals = np.zeros((count, 3))
        weighted = self.areas[:, None] * self.normals
        for axis in range(3):
            for corner in range(3):
                normals[:, axis] += np.bincount(corners[:, corner], weighted[:, axis], count)
        length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
        return np.where(length > 0, normals / np.where(length > 0, length, 1.0), 0.0)

    def parted(self, apart: NDArray[np.bool_]) -> "PlaneFrames":
        """Return the same frames, but with a field that does not cross the edges in `apart` either.

        `apart` is (T, 3); an edge is marked from both sides.
        """
        kept = np.ones(len(self.first), np.bool_)
        kept[self.edges[apart & (self.edges >= 0)]] = False
        number = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1).astype(np.int32)
        edges = number[self.edges]
        across, part = np.where(edges >= 0, self.across, np.int32(-1)), np.empty_like(self.part)
        return replace(
            self,
            first=self.first[kept],
            second=self.second[kept],
            carried=self.carried[kept],
            weights=self.weights[kept],
            across=across,
            edges=edges,
            part=part,
            parts=regions(across, part),
        )

    def vectors(self, numbers: ComplexArray) -> FloatArray:
        """Return complex numbers (T,) as vectors (T, 3)."""
        found: FloatArray = numbers.real[:, None] * self.x + numbers.imag[:, None] * self.y
        return found


def power(z: ComplexArray, symmetry: int) -> ComplexArray:
    """Return z to the power of 1, 2 or 4, by products."""
    return z if symmetry == 1 else z * z if symmetry == 2 else (z * z) * (z * z)


def root(z: ComplexArray) -> ComplexArray:
    """Return the square root of numbers of size 1."""
    up = np.sqrt(np.maximum(0.5 * (1 - z.real), 0))
    found: ComplexArray = np.sqrt(np.maximum(0.5 * (1 + z.real), 0)) + 1j * np.where(z.imag < 0, -up, up)
    return found


def plane_frames(mesh: TriangleMesh, crease: float | None) -> PlaneFrames:
    """Return the frames of a mesh; a field crosses edges that bend by at most `crease` degrees."""
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    lengths = np.sqrt(np.einsum("tki,tki->tk", edges, edges))
    along, sizes, areas = _shapes(lengths, mesh.size)
    normals = _normals(mesh, lengths)
    x, y = _axes(edges, lengths, along, normals)
    goes_on = mesh.neighbours >= 0
    beyond = mesh.neighbours // 3
    if crease is not None:
        bend = np.einsum("ti,tki->tk", normals, normals[beyond])
        goes_on &= bend >= np.cos(np.radians(crease))
    across = np.where(goes_on, beyond, -1).astype(np.int32)
    triangle, edge = np.nonzero(goes_on & (mesh.neighbours > 3 * np.arange(len(across))[:, None] + 2))
    met = mesh.neighbours[triangle, edge]
    other = met // 3
    here, there = along[triangle, edge], along[other, met % 3]
    long = np.minimum(sizes[triangle, edge], sizes[other, met % 3])
    weights = 1.5 * long * long / (areas[triangle] + areas[other])
    part = np.empty(len(across), np.int32)
    edges_of = np.full(across.shape, -1, np.int32)
    edges_of[triangle, edge] = edges_of[other, met % 3] = np.arange(len(triangle))
    return PlaneFrames(
        x,
        y,
        normals,
        along,
        areas,
        triangle.astype(np.int32),
        other.astype(np.int32),
        -there * np.conj(here),
        np.clip(weights, 1 / _HEAVIEST, _HEAVIEST),
        across,
        edges_of,
        part,
        regions(across, part),
    )


def _shapes(lengths: FloatArray, size: float) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return the edges' directions in the planes (T, 3), their lengths and areas, with slivers thickened.

    Source of the thickening: N. Sharp, K. Crane: A Laplacian for nonmanifold triangle meshes, Computer
    Graphics Forum 39, 2020, section 4.5; here triangle by triangle, as only angles are needed.
    """
    longest = np.maximum(lengths.max(axis=1), 1e-12 * size)
    excess = lengths.sum(axis=1)[:, None] - 2 * lengths
    sizes = lengths + np.maximum(_SLIVER * longest - excess.min(axis=1), 0)[:, None]
    a, b, c = sizes.T
    s = 0.5 * (a + b + c)
    areas = np.sqrt(np.maximum(s * (s - a) * (s - b) * (s - c), 0))
    areas = np.maximum(areas, 1e-6 * longest * longest)
    cosine = np.stack([(a * a + c * c - b * b) / (2 * a * c), (a * a + b * b - c * c) / (2 * a * b)])
    sine = np.stack([2 * areas / (a * c), 2 * areas / (a * b)])
    length = np.sqrt(cosine**2 + sine**2)
    cosine, sine = cosine / length, sine / length
    # Edge 0 is 1; edge 1 turns left at corner 1; edge 2 comes back to corner 0.
    along = np.stack(
        [np.ones(len(a), np.complex128), -cosine[1] + 1j * sine[1], -cosine[0] - 1j * sine[0]], axis=1
    )
    return along, sizes, areas


def _normals(mesh: TriangleMesh, lengths: FloatArray) -> FloatArray:
    """Return unit normals; a triangle with next to no area takes that of its neighbours."""
    flat = mesh.areas <= 1e-10 * lengths.max(axis=1) ** 2
    normals = np.where(flat[:, None], 0.0, mesh.flat_normals)
    across = mesh.neighbours // 3
    missing = np.flatnonzero(flat)
    for _ in range(64):
        if not len(missing):
            break
        total = np.where(mesh.neighbours[missing, :, None] >= 0, normals[across[missing]], 0.0).sum(axis=1)
        size = np.sqrt(np.einsum("ij,ij->i", total, total))
        found = size > 1e-3
        normals[missing[found]] = total[found] / size[found, None]
        if not found.any():
            break
        missing = missing[~found]
    normals[missing] = (0.0, 0.0, 1.0)
    return normals


def _axes(
    edges: FloatArray, lengths: FloatArray, along: ComplexArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return x and y of the frames, from each triangle's longest edge."""
    rows, longest = np.arange(len(edges)), lengths.argmax(axis=1)
    line = edges[rows, longest]
    line = line - np.einsum("ij,ij->i", line, normals)[:, None] * normals
    size = np.sqrt(np.einsum("ij,ij->i", line, line))
    pointless = size <= 1e-12 * lengths.max()
    if pointless.any():  # any direction at right angles to the normal will do
        least = np.eye(3)[np.abs(normals).argmin(axis=1)]
        stand_in = np.cross(normals, least)
        line = np.where(pointless[:, None], stand_in, line)
        size = np.where(pointless, np.sqrt(np.einsum("ij,ij->i", line, line)), size)
    line = line / size[:, None]
    turn = along[rows, longest]
    x = turn.real[:, None] * line - turn.imag[:, None] * np.cross(normals, line)
    return x, np.cross(normals, x)
