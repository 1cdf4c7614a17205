"""A watertight mesh of quadrilaterals over a surface."""

from dataclasses import dataclass

import numpy as np

from upholster.errors import InputError
from upholster.geometry.junctions import Junctions, cell_fans, find_junctions, weld
from upholster.geometry.surface import Surface
from upholster.types import FloatArray, IntArray, frozen_array

__all__ = ["MAX_QUADS", "Mesh", "tessellate"]

MAX_QUADS = 10_000_000


@dataclass(frozen=True, slots=True)
class Mesh:
    """Quadrilaterals, uniform in each patch's parameters, and triangles where a finer neighbour meets a side.

    Vertices belong to one patch each. Where edges meet, vertices of several patches lie at one position, the
    same to the bit: a closed surface gives a mesh without gaps. Faces run counter-clockwise seen from
    outside.

    Attributes
    ----------
    positions
        (V, 3) float64, in the model's units.
    normals
        (V, 3) float64, unit length: the patch's exact normals.
    parameters
        (V, 2) float64: (s, t).
    patch
        (V,) int32: which patch a vertex belongs to.
    quads
        (Q, 4) int32: vertices of a quadrilateral; two may coincide at a degenerate edge.
    triangles
        (T, 3) int32: only at T-junctions.
    """

    positions: FloatArray
    normals: FloatArray
    parameters: FloatArray
    patch: IntArray
    quads: IntArray
    triangles: IntArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for name in ("positions", "normals", "parameters", "patch", "quads", "triangles"):
            frozen_array(getattr(self, name))

    def all_triangles(self) -> IntArray:
        """Return every face as triangles (N, 3) int32; quadrilaterals are cut from first to third vertex.

        Triangles with two corners at one position are left out.
        """
        halves = self.quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        faces = np.concatenate([halves, self.triangles])
        # only quadrilaterals at degenerate edges collapse: look closer at those whose corners coincide in x
        x = self.positions[:, 0]
        a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
        maybe = np.flatnonzero((a == b) | (b == c) | (c == a))
        corners = self.positions[faces[maybe]]
        same = (corners == corners[:, [1, 2, 0]]).all(axis=2).any(axis=1)
        return np.delete(faces, maybe[same], axis=0)


def tessellate(surface: Surface, *, quads: int = 50_000) -> Mesh:
    """Cover a surface with about `quads` quadrilaterals: k × k per patch, k = round(√(quads/patches)).

    Parameters
    ----------
    surface
        Patches and how they meet.
    quads
        Wanted number over the whole surface: 1 to 10,000,000.

    Returns
    -------
    Mesh
        Watertight where edges meet. A patch's vertices come together, row by row, those of patch 0 first;
        vertices that only T-junctions need stand at the end.

    Raises
    ------
    InputError
        If quads is outside its range, or more than two edges of the surface meet in one place.
    """
    if not (isinstance(quads, int) and 1 <= quads <= MAX_QUADS):
        raise InputError(f"quads is {quads}; allowed: 1 to {MAX_QUADS}")
    count = len(surface.patches)
    k = max(1, round((quads / count) ** 0.5))
    u = np.arange(k + 1) / k
    grid = (k + 1) ** 2
    positions, normals = np.empty((count, grid, 3)), np.empty((count, grid, 3))
    for p, patch in enumerate(surface.patches):
        at, normal = patch.frames_grid(u, u)
        positions[p], normals[p] = at.reshape(-1, 3), normal.reshape(-1, 3)
    parameters = np.stack(np.meshgrid(u, u, indexing="ij"), axis=-1).reshape(-1, 2)
    corner = (np.arange(k)[:, None] * (k + 1) + np.arange(k)).astype(np.int32)
    cell = np.stack([corner, corner + (k + 1), corner + (k + 2), corner + 1], axis=-1).reshape(-1, 4)
    faces = (np.arange(count, dtype=np.int32)[:, None, None] * grid + cell).reshape(-1, 4)

    found = find_junctions(surface, k)
    fans = cell_fans(found, k)
    positions, normals = positions.reshape(-1, 3), normals.reshape(-1, 3)
    parameters = np.tile(parameters, (count, 1))
    owner = np.repeat(np.arange(count, dtype=np.int32), grid)
    if found.patch:
        extra = _extra_vertices(surface, found)
        positions, normals = np.concatenate([positions, extra[0]]), np.concatenate([normals, extra[1]])
        parameters, owner = np.concatenate([parameters, extra[2]]), np.concatenate([owner, extra[3]])
        faces = np.delete(faces, fans.cells, axis=0)
    weld(positions, found.pairs)
    return Mesh(positions, normals, parameters, owner, faces, fans.triangles)


def _extra_vertices(
    surface: Surface, found: Junctions
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Return positions, normals, parameters and patches of the vertices outside the uniform grids."""
    patch = np.array(found.patch, dtype=np.int32)
    parameters = np.array(found.parameters)
    positions, normals = np.empty((len(patch), 3)), np.empty((len(patch), 3))
    order = np.argsort(patch, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(patch[order])) + 1):
        s, t = parameters[mine].T
        positions[mine], normals[mine] = surface.patches[patch[mine[0]]].frames(s, t)
    return positions, normals, parameters, patch
