"""Triangle meshes: `TriangleMesh` as in files, and `MeshSurface`, which is cut into islands for charts.

An *island* is to a mesh what a face is to a surface of patches: a flattened piece of it. Its parameters (s,
t) are lengths in model units, as accurate as the layout allows: seen from outside, s runs down and t to the
right. Charts are rectangles of an island's parameters as they are of a face's.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray, frozen_array
from upholster.geometry.meshes.edge_pairs import edge_pairs

__all__ = ["MAX_TRIANGLES", "MeshSurface", "TriangleMesh", "welded"]

MAX_TRIANGLES = 4_000_000

_LARGEST = 1e18
"""Largest coordinate: its square is still within single precision's range."""


@dataclass(frozen=True, eq=False)
class TriangleMesh(Shown):
    """Triangles in space. Two that use the same vertex meet there; make shared vertices with `welded`.

    Attributes
    ----------
    positions
        (V, 3) float64, read-only, in model units.
    triangles
        (T, 3) int32, read-only: vertices, counter-clockwise seen from outside.
    part
        (T,) int32, read-only: the index in `parts` of each triangle's part; by default all the first.
    parts
        Names of the parts, as users choose them.
    uv
        The file's texture coordinates, (T, 3, 2) float64 at each triangle's corners, u to the right and v
        downward; None where it has none.
    normals
        The file's normals, (T, 3, 3) float64, at each triangle's corners; None where it has none.
    name
        Name in reports and files.
    metres
        Length of a model unit in metres; None where the file does not state it.

    Raises
    ------
    InputError
        For no triangles or too many, other shapes, vertices or parts that do not exist, or positions that are
        not finite numbers within ±1e18.
    """

    positions: FloatArray
    triangles: IntArray
    part: IntArray = field(default_factory=lambda: np.zeros(0, np.int32))
    parts: tuple[str, ...] = ("mesh",)
    uv: FloatArray | None = None
    normals: FloatArray | None = None
    name: str = ""
    metres: float | None = None

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        count = _count(self.triangles)
        arrays: dict[str, NDArray[Any] | None] = {
            "positions": np.ascontiguousarray(self.positions, np.float64),
            "triangles": np.ascontiguousarray(self.triangles, np.int32),
            "part": np.ascontiguousarray(self.part if len(self.part) else np.zeros(count), np.int32),
            "uv": None if self.uv is None else np.ascontiguousarray(self.uv, np.float64),
            "normals": None if self.normals is None else np.ascontiguousarray(self.normals, np.float64),
        }
        for name, array in arrays.items():
            object.__setattr__(self, name, None if array is None else frozen_array(array))
        _check_arrays(self, count)

    def __repr__(self) -> str:
        parts = {"name": self.name, "triangles": len(self.triangles), "parts": len(self.parts)}
        return on_a_line(self, parts)

    @cached_property
    def box(self) -> FloatArray:
        """Least and greatest coordinates of the triangles' corners, (2, 3)."""
        used = self.positions[np.unique(self.triangles)]
        return frozen_array(np.stack([used.min(axis=0), used.max(axis=0)]))

    @cached_property
    def size(self) -> float:
        """Diagonal of `box`, in model units."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @cached_property
    def corners(self) -> FloatArray:
        """Positions of the triangles' corners, (T, 3, 3)."""
        return frozen_array(self.positions[self.triangles])

    @cached_property
    def areas(self) -> FloatArray:
        """Areas of the triangles, (T,), in square model units."""
        return self._measured[1]

    @cached_property
    def flat_normals(self) -> FloatArray:
        """Unit normals of the triangles, (T, 3), outward; zero for degenerate triangles."""
        return self._measured[0]

    @cached_property
    def _measured(self) -> tuple[FloatArray, FloatArray]:
        a, b, c = self.corners.transpose(1, 2, 0)
        with np.errstate(over="ignore", invalid="ignore"):
            (x1, y1, z1), (x2, y2, z2) = b - a, c - a
            normals = np.stack([y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2], axis=1)
            x, y, z = normals.T
            length = np.sqrt(x * x + y * y + z * z)
            whole = length[:, None] > 0
            normals = np.divide(normals, length[:, None], out=np.zeros_like(normals), where=whole)
        return frozen_array(normals), frozen_array(0.5 * length)

    @cached_property
    def neighbours(self) -> IntArray:
        """The neighbour across each triangle's edges, (T, 3) int32, as triangle · 3 + its edge, or −1.

        Edge k runs from corner k to corner (k + 1) mod 3. The neighbour has the same edge in the opposite
        direction; among several it is the most nearly coplanar one, see `edge_pairs`. There is none at
        borders and where two triangles traverse an edge in the same direction. Triangles that name a vertex
        twice are ignored.
        """
        return frozen_array(edge_pairs(self.positions, self.triangles))


@dataclass(frozen=True, eq=False)
class MeshSurface(Shown):
    """A mesh cut into islands, for charts.

    Attributes
    ----------
    mesh
        The triangles.
    island
        (T,) int32, read-only: the island of each triangle, 0 to their number − 1; −1 for triangles that are
        left plain.
    parameters
        (T, 3, 2) float64, read-only: (s, t) of each triangle's corners on its island, in model units. Two
        triangles of an island are connected over a common edge if it has the same parameters at both ends;
        any other common edge is a seam. Triangles have the same orientation as in space:
        ``(s1 − s0)·(t2 − t0) − (t1 − t0)·(s2 − s0) > 0`` except for degenerate ones.

    Raises
    ------
    InputError
        For other shapes, numbers that are not finite, or islands without triangles.
    """

    mesh: TriangleMesh
    island: IntArray
    parameters: FloatArray

    def __post_init__(self) -> None:
        """Check the arrays and make them read-only."""
        count = len(self.mesh.triangles)
        island = np.ascontiguousarray(self.island, np.int32)
        parameters = np.ascontiguousarray(self.parameters, np.float64)
        if island.shape != (count,) or parameters.shape != (count, 3, 2):
            raise InputError(
                f"islands have shape {island.shape}, parameters {parameters.shape}; allowed: ({count},) and "
                f"({count}, 3, 2)"
            )
        used = np.unique(island[island >= 0])
        if not len(used) or used[-1] != len(used) - 1 or island.min() < -1:
            raise InputError("islands are not numbered 0, 1, 2 …; allowed: each with a triangle, -1 for none")
        if not np.isfinite(parameters[island >= 0]).all():
            raise InputError("a parameter is not finite; allowed: finite numbers")
        object.__setattr__(self, "island", frozen_array(island))
        object.__setattr__(self, "parameters", frozen_array(parameters))

    def __repr__(self) -> str:
        parts = {"name": self.name, "triangles": len(self.island), "islands": self.islands}
        return on_a_line(self, parts)

    @property
    def name(self) -> str:
        """Name in reports and files."""
        return self.mesh.name

    @property
    def size(self) -> float:
        """Diagonal of the mesh's box, in model units."""
        return self.mesh.size

    def is_like(self, other: object) -> bool:
        """Whether another has as many triangles, and islands of the same size to a thousandth of its size."""
        if self is other:
            return True
        if not isinstance(other, MeshSurface):
            return False
        if len(self.island) != len(other.island) or self.islands != other.islands:
            return False
        return bool(np.allclose(self.boxes, other.boxes, rtol=0, atol=1e-3 * self.size))

    @cached_property
    def islands(self) -> int:
        """Number of islands."""
        return int(self.island.max()) + 1

    @cached_property
    def boxes(self) -> FloatArray:
        """Least and greatest (s, t) of each island, (islands, 2, 2)."""
        out = np.empty((self.islands, 2, 2))
        out[:, 0], out[:, 1] = np.inf, -np.inf
        laid = self.island >= 0
        owner = np.repeat(self.island[laid], 3)
        np.minimum.at(out[:, 0], owner, self.parameters[laid].reshape(-1, 2))
        np.maximum.at(out[:, 1], owner, self.parameters[laid].reshape(-1, 2))
        return frozen_array(out)


def welded(positions: ArrayLike) -> tuple[FloatArray, IntArray]:
    """Merge vertices at exactly the same place.

    Parameters
    ----------
    positions
        (V, 3).

    Returns
    -------
    positions
        (W, 3) float64, in the order in which they first occur.
    vertex
        (V,) int32: the new number of each given vertex.
    """
    points = np.ascontiguousarray(positions, np.float64) + 0.0  # −0 is 0
    _, first, inverse = np.unique(
        points.view(np.dtype((np.void, 24))).reshape(-1), return_index=True, return_inverse=True
    )
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return points[first[order]], rank[inverse.reshape(-1)]


def _count(triangles: object) -> int:
    shape = np.asarray(triangles).shape
    if len(shape) != 2 or shape[1] != 3 or not 1 <= shape[0] <= MAX_TRIANGLES:
        raise InputError(f"triangles have shape {shape}; allowed: (n, 3), n from 1 to {MAX_TRIANGLES}")
    return int(shape[0])


def _check_arrays(mesh: TriangleMesh, count: int) -> None:
    if mesh.positions.ndim != 2 or mesh.positions.shape[1] != 3:
        raise InputError(f"positions have shape {mesh.positions.shape}; allowed: (n, 3)")
    if not (np.abs(mesh.positions) <= _LARGEST).all():
        raise InputError("a position is not finite, or beyond ±1e18; allowed: finite numbers within")
    low, high = int(mesh.triangles.min()), int(mesh.triangles.max())
    if low < 0 or high >= len(mesh.positions):
        raise InputError(f"triangles name vertices {low} to {high}; allowed: 0 to {len(mesh.positions) - 1}")
    if mesh.part.shape != (count,) or mesh.part.min() < 0 or mesh.part.max() >= len(mesh.parts):
        raise InputError(f"part has shape {mesh.part.shape}; allowed: ({count},), 0 to {len(mesh.parts) - 1}")
    for name, array, shape in (("uv", mesh.uv, (count, 3, 2)), ("normals", mesh.normals, (count, 3, 3))):
        if array is not None and (array.shape != shape or not np.isfinite(array).all()):
            raise InputError(f"{name} have shape {array.shape}; allowed: {shape}, finite numbers")
