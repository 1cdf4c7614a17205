"""Patches without order, joined into faces: where they go on smoothly into each other, in whole grids."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.geometry.edges import Edges
from upholster.geometry.face import INSIDE, JUMP, Face
from upholster.geometry.patch import RationalPatch
from upholster.geometry.surface import Surface
from upholster.types import FloatArray

__all__ = ["join_patches"]

Standing = tuple[int, int]
"""A patch, and how many quarter turns it makes in its face: edge k there is its edge (k + turns) mod 4."""

Neighbours = dict[tuple[int, int], tuple[int, int]]
"""(patch, edge) to the (patch, edge) that it goes on to."""


def join_patches(surface: Surface) -> Surface:
    """Join patches that go on smoothly across whole edges into faces, as far as they form grids.

    From each patch that is left, in order, a grid grows by whole rows and columns, one way after another, as
    long as all patches of the next one are there and join their neighbours smoothly. Patches are turned to
    fit; a face stands as its first patch does.

    Parameters
    ----------
    surface
        One patch a face.

    Returns
    -------
    Surface
        The same points, name and tolerance; faces in the order of their first patches.
    """
    beside = _smooth_neighbours(surface)
    free = set(range(len(surface.patches)))
    faces = []
    for first in range(len(surface.patches)):
        if first in free:
            grid = _grown(first, free, beside)
            free.difference_update(patch for row in grid for patch, _ in row)
            faces.append(Face([[_turned(surface.patches[one], turns) for one, turns in row] for row in grid]))
    return Surface(faces, surface.name, surface.tolerance)


def _smooth_neighbours(surface: Surface) -> Neighbours:
    """Return which edges go on into which, over their whole length and with the same derivatives across."""
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
    # Outward of the one patch is inward of the other.
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
    """Return whether two patches have their normals on one side: clockwise, their edges run in opposition."""
    return opposed == ((edge in (0, 1)) == (other in (0, 1)))


def _outward(edges: NDArray[np.int64]) -> FloatArray:
    """Return the signs (n, 1, 1) that make derivatives across edges point outward."""
    return np.where(np.isin(edges % 4, (1, 2)), 1.0, -1.0)[:, None, None]


def _grown(first: int, free: set[int], beside: Neighbours) -> list[list[Standing]]:
    """Return the largest grid that grows from a patch: to the right, downward, to the left, upward."""
    grid, taken = [[(first, 0)]], {first}
    for edge in (1, 2, 3, 0):
        while True:
            columns = [list(column) for column in zip(*grid, strict=True)]
            border = (grid[0], columns[-1], grid[-1], columns[0])[edge]
            line = _next_line(border, edge, free, taken, beside)
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
    border: Sequence[Standing], edge: int, free: set[int], taken: set[int], beside: Neighbours
) -> list[Standing] | None:
    """Return what lies beyond a grid's row or column; None if it is not all there, or does not join."""
    line: list[Standing] = []
    along = 2 if edge & 1 else 1  # the edge at which one of the line meets the next one
    for patch, turns in border:
        found = _across((patch, turns), edge, beside)
        if found is None or found[0] not in free or found[0] in taken:
            return None
        if line and _across(line[-1], along, beside) != found:
            return None
        line.append(found)
    return line if len({patch for patch, _ in line}) == len(line) else None


def _across(standing: Standing, edge: int, beside: Neighbours) -> Standing | None:
    """Return the patch beyond an edge of one that stands so, and how it stands."""
    patch, turns = standing
    found = beside.get((patch, (edge + turns) % 4))
    return None if found is None else (found[0], (found[1] - edge - 2) % 4)


def _turned(patch: RationalPatch, turns: int) -> RationalPatch:
    """Return the same patch, its edge `turns` at the top."""
    return RationalPatch(np.rot90(patch.net, turns)) if turns else patch
