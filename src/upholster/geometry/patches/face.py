"""`Face`: a tensor grid of rational Bézier patches with one parameter rectangle."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.patches.edges import Edges
from upholster.geometry.patches.patch import RationalPatch, parameter_list, parameter_pairs

__all__ = ["Face", "grid_face"]

INSIDE = np.linspace(0.1, 0.9, 5)
"""Places along two edges at which derivatives are compared: not at their ends, which may be poles."""

JUMP = 0.05
"""Derivatives jump if they differ by more than this share of the longer one."""

Evaluate = Callable[[RationalPatch, FloatArray, FloatArray], tuple[FloatArray, ...]]
"""``evaluate(patch, s, t)``: some of points, derivatives and normals, at the patch's own parameters."""


@dataclass(frozen=True, eq=False)
class Face:
    """A tensor grid of patches: a NURBS surface in Bézier form, or a single patch.

    Its parameters run over [0, rows] × [0, columns]; patch (i, j) covers s from i to i + 1 and t from j to
    j + 1. On the border of two patches the one after it, with the greater s or t, is used. Beyond the
    rectangle the outermost patches' functions continue. Edge 0 is s = 0, edge 1 t = columns, edge 2 s = rows,
    edge 3 t = 0, with parameters along them as for a patch (CONVENTIONS.md). The patches should join within
    the surface's tolerance. Two faces are equal only if they are the same object.

    Attributes
    ----------
    patches
        Rows of patches, all of the same length, 1 or more each way.

    Raises
    ------
    InputError
        If rows are empty or of different lengths, or an entry is not a patch.
    """

    patches: Sequence[Sequence[RationalPatch]]

    def __post_init__(self) -> None:
        """Check the grid and keep it as tuples."""
        grid = tuple(tuple(row) for row in self.patches)
        if not grid or not grid[0] or len({len(row) for row in grid}) != 1:
            raise InputError("a face has rows of different lengths or none; allowed: a grid of patches")
        for i, row in enumerate(grid):
            for j, patch in enumerate(row):
                if not isinstance(patch, RationalPatch):
                    raise InputError(
                        f"patch [{i}, {j}] of a face is a {type(patch).__name__}; allowed: RationalPatch"
                    )
        object.__setattr__(self, "patches", grid)

    @property
    def rows(self) -> int:
        """Number of patches along s; the face's s runs from 0 to this."""
        return len(self.patches)

    @property
    def columns(self) -> int:
        """Number of patches along t; the face's t runs from 0 to this."""
        return len(self.patches[0])

    def line(self, edge: int) -> float:
        """Return the parameter s (edges 0 and 2) or t (edges 1 and 3) of an edge's line."""
        return (0.0, float(self.columns), float(self.rows), 0.0)[edge]

    def points(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return the points at parameters s and t of one shape (...,): shape (..., 3), in the model's units.

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        return self.derivatives(s, t)[0]

    def derivatives(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points and first derivatives (P, S_s, S_t) at s and t of one shape (...,): each (..., 3).

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        points, by_s, by_t = self._scattered(s, t, RationalPatch.derivatives, 3)
        return points, by_s, by_t

    def frames(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return points and unit normals at s and t of one shape (...,): each (..., 3).

        At degenerate points (poles, collapsed edges) normals are the limits along the patch; never NaN.

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        points, normals = self._scattered(s, t, RationalPatch.frames, 2)
        return points, normals

    def points_grid(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return the points at all pairs of s (S,) and t (T,): shape (S, T, 3), in the model's units.

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        return self._grid(s, t, lambda patch, u, v: (patch.points_grid(u, v),), 1)[0]

    def derivatives_grid(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points and derivatives (P, S_s, S_t) at all pairs of s (S,) and t (T,): each (S, T, 3).

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        points, by_s, by_t = self._grid(s, t, RationalPatch.derivatives_grid, 3)
        return points, by_s, by_t

    def frames_grid(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return points and unit normals at all pairs of s (S,) and t (T,): each (S, T, 3).

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        points, normals = self._grid(s, t, RationalPatch.frames_grid, 2)
        return points, normals

    @cached_property
    def breaks(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Lines s = k and t = k inside the face across which derivatives jump by more than a twentieth."""
        if self.rows == self.columns == 1:
            return (), ()
        edges = Edges([patch for row in self.patches for patch in row])
        number = np.arange(self.rows * self.columns).reshape(self.rows, self.columns)
        found = []
        for before, after, axis, edge in (
            (number[:-1], number[1:], 1, 0),
            (number[:, :-1], number[:, 1:], 0, 3),
        ):
            jumps = _jumps(edges, 4 * before.ravel() + (edge + 2) % 4, 4 * after.ravel() + edge)
            lines = np.flatnonzero(jumps.reshape(before.shape).any(axis=axis)) + 1
            found.append(tuple(lines.tolist()))
        return found[0], found[1]

    def reverse(self, axis: int) -> "Face":
        """Return the face with s (axis 0) or t (axis 1) reversed; its normals flip.

        Raises
        ------
        InputError
            If axis is neither 0 nor 1.
        """
        grid = [[patch.reverse(axis) for patch in row] for row in self.patches]
        return Face(grid[::-1] if axis == 0 else [row[::-1] for row in grid])

    def _scattered(
        self, s: ArrayLike, t: ArrayLike, evaluate: Evaluate, parts: int
    ) -> tuple[FloatArray, ...]:
        """Evaluate at pairs of parameters, patch by patch."""
        s, t = parameter_pairs(s, t)
        if self.rows == self.columns == 1:
            return evaluate(self.patches[0][0], s, t)
        shape, s, t = s.shape, s.ravel(), t.ravel()
        row, column = _index(s, self.rows), _index(t, self.columns)
        out = np.empty((parts, len(s), 3))
        for mine in _groups(row * self.columns + column):
            i, j = int(row[mine[0]]), int(column[mine[0]])
            out[:, mine] = evaluate(self.patches[i][j], s[mine] - i, t[mine] - j)
        return tuple(out.reshape(parts, *shape, 3))

    def _grid(self, s: ArrayLike, t: ArrayLike, evaluate: Evaluate, parts: int) -> tuple[FloatArray, ...]:
        """Evaluate at all pairs of two lists, patch by patch."""
        s, t = parameter_list("s", s), parameter_list("t", t)
        if self.rows == self.columns == 1:
            return evaluate(self.patches[0][0], s, t)
        row, column = _index(s, self.rows), _index(t, self.columns)
        out = np.empty((parts, len(s), len(t), 3))
        across = [(int(column[mine[0]]), mine) for mine in _groups(column)]
        for down in _groups(row):
            i = int(row[down[0]])
            for j, right in across:
                found = evaluate(self.patches[i][j], s[down] - i, t[right] - j)
                out[:, down[:, None], right] = found
        return tuple(out)


def grid_face(patches: Sequence[RationalPatch], columns: int) -> Face:
    """Return a face of patches listed row by row.

    Raises
    ------
    InputError
        If they do not fill complete rows of this many columns.
    """
    return Face([patches[k : k + columns] for k in range(0, len(patches), columns)])


def _jumps(edges: Edges, before: NDArray[np.intp], after: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return whether the derivatives across edges (n,) differ on the two sides."""
    u = np.broadcast_to(INSIDE, (len(before), len(INSIDE)))
    a, b = edges.across(before, u), edges.across(after, u)
    longer = np.maximum(np.linalg.norm(a, axis=2), np.linalg.norm(b, axis=2))
    jumps: NDArray[np.bool_] = (np.linalg.norm(a - b, axis=2) > JUMP * longer).any(axis=1)
    return jumps


def _index(values: FloatArray, count: int) -> NDArray[np.intp]:
    """Return the patch that each parameter along one axis is on; the outermost patches extend without end."""
    return np.clip(np.floor(values), 0, count - 1).astype(np.intp)


def _groups(numbers: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield the places of each number that occurs, in increasing order."""
    order = np.argsort(numbers, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1):
        if len(group):
            yield group
