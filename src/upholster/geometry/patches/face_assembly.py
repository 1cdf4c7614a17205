"""Joining unordered patches into faces: complete grids of patches that continue smoothly into each other."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.geometry.patches.edges import Edges
from upholster.geometry.patches.face import INSIDE, JUMP, Face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["join_patches"]

Standing = tuple[int, int]
"""A patch, and its quarter turns in its face: edge k in the face is the patch's edge (k + turns) mod 4."""

Neighbours = dict[tuple[int, int], tuple[int, int]]
"""Maps (patch, edge) to the (patch, edge) that continues it."""


def join_patches(surface: Surface) -> Surface:
    """Join patches that continue smoothly across complete edges into faces, where they form grids.

    From each remaining patch, in order, a grid grows by complete rows and columns, one direction after
    another, as long as all patches of the next one are available and join their neighbours smoothly. Patches
    are rotated to fit; a face takes the orientation of its first patch.

    Parameters
    ----------
    surface
        One patch per face.

    Returns
    -------
    Surface
        The same points, name and tolerance; faces in the order of their first patches.
    """
    neighbours = _smooth_neighbours(surface)
    free = set(range(len(surface.patches)))
    faces = []
    for first in range(len(surface.patches)):
        if first in free:
            grid = _grown(first, free, neighbours)
            free.difference_update(patch for row in grid for patch, _ in row)
            faces.append(Face([[_turned(surface.patches[one], turns) for one, turns in row] for row in grid]))
    return Surface(faces, surface.name, surface.tolerance)


def _smooth_neighbours(surface: Surface) -> Neighbours:
    """Return which edges continue each other, over their complete length with the same derivatives across."""
    whole = [
        seam for seam in surface.shared if seam.whole and _alike(seam.edge, seam.other_edge, seam.opposed)
    ]
    if not whole:
        return {}
    edges = Edges(surface.patches)
    a = np.array([4 * seam.patch + seam.edge for seam in whole])
    b = np.array([4 * seam.other_patch + seam.other_edge for seam in whole])
    u = np.broadcast_to(INSIDE, (len(whole), len(INSIDE)))
    opposed = np.array([seam.opposed for seam in whole])[:, None]
    # Outward on one patch is inward on the other.
    outward = edges.across(a, u) * _outward(a)
    inward = -edges.across(b, np.where(opposed, 1.0 - u, u)) * _outward(b)
    longer = np.maximum(np.linalg.norm(outward, axis=2), np.linalg.norm(inward, axis=2))
    smooth = (np.linalg.norm(outward - inward, axis=2) <= JUMP * longer).all(axis=1)
    found: Neighbours = {}
    for one, other in zip(a[smooth].tolist(), b[smooth].tolist(), strict=True):
        here, there = divmod(one, 4), divmod(other, 4)
        found[here], found[there] = there, here
    return found


def _alike(edge: int, other: int, opposed: bool) -> bool:
    """Return whether the normals agree: then, in clockwise order, the edges run in opposite directions."""
    return opposed == ((edge in (0, 1)) == (other in (0, 1)))


def _outward(edges: NDArray[np.int64]) -> FloatArray:
    """Return the signs (n, 1, 1) that make derivatives across edges point outward."""
    return np.where(np.isin(edges % 4, (1, 2)), 1.0, -1.0)[:, None, None]


def _grown(first: int, free: set[int], neighbours: Neighbours) -> list[list[Standing]]:
    """Return the largest grid that grows from a patch: to the right, downward, to the left, upward."""
    grid, taken = [[(first, 0)]], {first}
    for edge in (1, 2, 3, 0):
        while True:
            columns = [list(column) for column in zip(*grid, strict=True)]
            border = (grid[0], columns[-1], grid[-1], columns[0])[edge]
            line = _next_line(border, edge, free, taken, neighbours)
            if line is None:
                break
            taken.update(patch for patch, _ in line)
            if edge in (0, 2):
                grid = [line, *grid] if edge == 0 else [*grid, line]
            else:
                grid = [
                    [one, *row] if edge == 3 else [*row, one] for row, one in zip(grid, line, strict=True)
                ]
    return grid


def _next_line(
    border: Sequence[Standing], edge: int, free: set[int], taken: set[int], neighbours: Neighbours
) -> list[Standing] | None:
    """Return the patches beyond a grid's row or column; None if some are missing or do not join."""
    line: list[Standing] = []
    along = 2 if edge & 1 else 1  # the edge at which patches of the line meet
    for patch, turns in border:
        found = _across((patch, turns), edge, neighbours)
        if found is None or found[0] not in free or found[0] in taken:
            return None
        if line and _across(line[-1], along, neighbours) != found:
            return None
        line.append(found)
    return line if len({patch for patch, _ in line}) == len(line) else None


def _across(standing: Standing, edge: int, neighbours: Neighbours) -> Standing | None:
    """Return the patch across an edge of a patch in this orientation, and the new patch's orientation."""
    patch, turns = standing
    found = neighbours.get((patch, (edge + turns) % 4))
    return None if found is None else (found[0], (found[1] - edge - 2) % 4)


def _turned(patch: RationalPatch, turns: int) -> RationalPatch:
    """Return the same patch with its edge `turns` at the top."""
    return RationalPatch(np.rot90(patch.net, turns)) if turns else patch
