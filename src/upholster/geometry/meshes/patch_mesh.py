"""Converting a surface of patches to triangles that are connected over shared edges and at poles."""

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import IntArray
from upholster.geometry.components import connected
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES, TriangleMesh
from upholster.geometry.patches.surface import Surface

__all__ = ["can_be_mesh", "patch_mesh"]

_DEVIATION = 1 / 1000
"""Greatest distance of triangles from polynomial patches, as a share of the surface's size, by an upper bound
that is usually about twice the true distance."""

_FEWEST, _MOST = 4, 32
"""Least and greatest number of parts of a patch, each way."""


def can_be_mesh(surface: Surface) -> bool:
    """Return whether all edges that meet do so over their full length, so that `patch_mesh` has no gaps."""
    return all(seam.whole for seam in surface.shared)


def patch_mesh(surface: Surface) -> TriangleMesh:
    """Return a surface as triangles, with the patches' own normals.

    All patches are divided into the same number of parts each way, so that vertices meet where edges do. Gaps
    between edges that nearly meet stay open.

    Parameters
    ----------
    surface
        A surface whose shared edges meet over their complete length.

    Raises
    ------
    InputError
        If some edges meet only over a part.
    """
    if not can_be_mesh(surface):
        raise InputError("edges of the surface meet over parts; allowed: patches that share whole edges")
    n = _parts(surface)
    parameters = np.linspace(0.0, 1.0, n + 1)
    frames = [patch.frames_grid(parameters, parameters) for patch in surface.patches]
    positions, normals = (np.stack(part).reshape(-1, 3) for part in zip(*frames, strict=True))
    numbers = np.arange(len(positions), dtype=np.int32).reshape(-1, n + 1, n + 1)
    vertex = connected(len(positions), _pairs(surface, numbers))
    a, b = numbers[:, :-1, :-1], numbers[:, 1:, :-1]
    c, d = numbers[:, 1:, 1:], numbers[:, :-1, 1:]
    quads = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=-2)
    corners = quads.reshape(-1, 3)
    triangles = vertex[corners]
    one, two, three = triangles.T
    kept = (one != two) & (two != three) & (three != one)
    used, compact = np.unique(triangles[kept], return_inverse=True)
    return TriangleMesh(
        positions[used],
        compact.reshape(-1, 3).astype(np.int32),
        normals=normals[corners[kept]],
        name=surface.name or "surface",
    )


def _parts(surface: Surface) -> int:
    """Return the parts of a patch each way, from bounds on second derivatives by the nets' differences."""
    bend = 0.0
    for patch in surface.patches:
        for axis, degree in enumerate(patch.degree):
            if degree > 1:
                second = np.linalg.norm(np.diff(patch.control_points, 2, axis=axis), axis=-1)
                bend = max(bend, degree * (degree - 1) * float(second.max()))
    wanted = np.sqrt(bend / (8 * _DEVIATION * surface.size))
    most = int(np.sqrt(MAX_TRIANGLES / (2 * len(surface.patches))))
    return max(1, min(most, int(np.clip(np.ceil(wanted), _FEWEST, _MOST))))


def _pairs(surface: Surface, numbers: IntArray) -> IntArray:
    """Return the pairs of vertices that coincide, (P, 2): on shared edges and on degenerate ones."""
    lines = (
        lambda k: numbers[k, 0],
        lambda k: numbers[k, :, -1],
        lambda k: numbers[k, -1],
        lambda k: numbers[k, :, 0],
    )
    pairs = [np.zeros((0, 2), np.int32)]
    for seam in surface.shared:
        here, there = lines[seam.edge](seam.patch), lines[seam.other_edge](seam.other_patch)
        pairs.append(np.stack([here, there[::-1] if seam.opposed else there], axis=1))
    for patch, edge in sorted(surface.degenerate):
        line = lines[edge](patch)
        pairs.append(np.stack([line[:-1], line[1:]], axis=1))
    return np.concatenate(pairs)
