"""All edges of a list of patches, evaluated together: edge number 4·patch + edge."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.geometry.patches.bernstein import bernstein, bernstein_derivative
from upholster.geometry.patches.patch import RationalPatch

__all__ = ["Edges"]


class Edges:
    """The boundary curves of patches, grouped by degree so that they are evaluated in few calls.

    Attributes
    ----------
    low, high
        Corners of the bounding boxes of each edge's control points, shape (E, 3): they contain the edge.
    """

    def __init__(self, patches: Sequence[RationalPatch]) -> None:
        count = 4 * len(patches)
        self._degree = np.empty(count, dtype=np.int64)
        self._row = np.empty(count, dtype=np.int64)
        self.low, self.high = np.empty((count, 3)), np.empty((count, 3))
        nets: dict[int, list[FloatArray]] = defaultdict(list)
        slopes: dict[int, list[FloatArray]] = defaultdict(list)
        alike: dict[tuple[int, ...], list[int]] = defaultdict(list)
        for number, patch in enumerate(patches):
            alike[patch.net.shape].append(number)
        for members in alike.values():
            stacked = np.stack([patches[number].net for number in members])
            for k in range(4):
                edge, slope = _edge(stacked, k)
                d = edge.shape[1] - 1
                index = 4 * np.array(members) + k
                self._degree[index] = d
                self._row[index] = sum(map(len, nets[d])) + np.arange(len(members))
                points = edge[..., :3] / edge[..., 3:]
                self.low[index], self.high[index] = points.min(axis=1), points.max(axis=1)
                nets[d].append(edge)
                slopes[d].append(slope)
        self._nets = {d: np.concatenate(parts) for d, parts in nets.items()}
        self._slopes = {d: np.concatenate(parts) for d, parts in slopes.items()}

    def __len__(self) -> int:
        """Return the number of edges."""
        return len(self._degree)

    def degenerate(self, tolerance: float) -> NDArray[np.bool_]:
        """Return which edges are points: their control points are within the tolerance (model units)."""
        small: NDArray[np.bool_] = np.linalg.norm(self.high - self.low, axis=1) <= tolerance
        return small

    def points(self, index: NDArray[np.int64], u: FloatArray) -> FloatArray:
        """Return the points of the edges `index` (N,) at their own parameters u (N, K): shape (N, K, 3)."""
        return self._sum(index, u, derivatives=False)[0]

    def derivatives(self, index: NDArray[np.int64], u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points and derivatives of the edges `index` (N,) at parameters u (N, K): each (N, K, 3)."""
        return self._sum(index, u, derivatives=True)

    def across(self, index: NDArray[np.int64], u: FloatArray) -> FloatArray:
        """Return the patches' derivatives across the edges `index` (N,) at parameters u (N, K): (N, K, 3).

        In the direction of growing s for edges 0 and 2, of growing t for edges 1 and 3.
        """
        out = np.empty((*u.shape, 3))
        degrees = self._degree[index]
        for d in np.unique(degrees).tolist():
            mine = degrees == d
            rows = self._row[index[mine]]
            basis = bernstein(d, u[mine])
            h, g = basis @ self._nets[d][rows], basis @ self._slopes[d][rows]
            out[mine] = (g[..., :3] - h[..., :3] / h[..., 3:] * g[..., 3:]) / h[..., 3:]
        return out

    def _sum(
        self, index: NDArray[np.int64], u: FloatArray, *, derivatives: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Evaluate the edges, degree by degree."""
        points, slopes = np.empty((*u.shape, 3)), np.empty((*u.shape, 3) if derivatives else (0, 3))
        degrees = self._degree[index]
        for d in np.unique(degrees).tolist():
            mine = degrees == d
            nets = self._nets[d][self._row[index[mine]]]
            h = bernstein(d, u[mine]) @ nets
            value = h[..., :3] / h[..., 3:]
            points[mine] = value
            if derivatives:
                g = bernstein_derivative(d, u[mine]) @ nets
                slopes[mine] = (g[..., :3] - value * g[..., 3:]) / h[..., 3:]
        return points, slopes


def _edge(nets: FloatArray, edge: int) -> tuple[FloatArray, FloatArray]:
    """Return an edge of nets (P, m+1, n+1, 4), and the homogeneous derivatives across it: (P, d+1, 4)."""
    grid = nets if edge in (0, 2) else nets.swapaxes(1, 2)
    first, second, degree = grid[:, 0], grid[:, 1], grid.shape[1] - 1
    if edge in (1, 2):
        return grid[:, -1], degree * (grid[:, -1] - grid[:, -2])
    return first, degree * (second - first)
