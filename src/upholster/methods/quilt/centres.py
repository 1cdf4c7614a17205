"""Where blocks' centres lie, and in which order they are laid: region after region, so that threads share them.

The surface is cut into cubes about four blocks wide, in eight classes by the parity of their place. Blocks of two
cubes of one class never touch: they are laid side by side. The order follows from the geometry alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._frame_kernels import Canvases, nearest_steps
from upholster.methods.quilt._unfold_kernels import MeshArrays
from upholster.types import FloatArray, IntArray

__all__ = ["Centres", "Regions", "centres_on"]

_REGION = 3.0
"""Side of a region's cube, in blocks: two blocks that meet lie less than one and a half apart."""


@dataclass(frozen=True, eq=False, slots=True)
class Centres:
    """Blocks' centres, n of them.

    Attributes
    ----------
    triangles, shares
        (n,) int32 and (n, 3) float64: where on the mesh, in barycentric coordinates.
    roots
        (n, 6): the chart, the place of the nearest step there, where that one reads, less the block's source, in
        frame pixels, and the quarter turns from the chart's matrix there to the block's.
    spots
        (n, 3) in space.
    """

    triangles: IntArray
    shares: FloatArray
    roots: FloatArray
    spots: FloatArray

    def chosen(self, order: NDArray[np.intp]) -> "Centres":
        """Return them in an order."""
        return Centres(self.triangles[order], self.shares[order], self.roots[order], self.spots[order])


def centres_on(mesh: MeshArrays, canvases: Canvases, step: float, shift: float, *, bare: bool) -> Centres:
    """Return centres on even grids over the charts, `step` steps apart, the first one at `shift`.

    Each is the step on the surface that lies nearest to a point of the grid; with `bare` of those that no block
    shows.
    """
    parts = [np.zeros((0, 3), np.int64)]
    for chart in range(len(canvases.heights)):
        sizes = canvases.heights[chart], canvases.widths[chart]
        shape = [max(1, int((size - shift) / step + 1.5)) for size in sizes]
        away, found = np.empty(shape), np.empty(shape, np.int32)
        nearest_steps(canvases, chart, step, shift, bare, away, found)
        rows, columns = np.divmod(found[found >= 0].astype(np.int64), sizes[1])
        parts.append(np.stack([np.full(len(rows), chart), rows, columns], axis=1))
    steps = np.concatenate(parts)
    chart, places = steps[:, 0], steps[:, 1:].astype(np.float64)
    triangles = canvases.triangles[
        canvases.firsts[chart] + steps[:, 1] * canvases.widths[chart] + steps[:, 2]
    ]
    shares = _shares(mesh.places[triangles], places)
    roots = np.zeros((len(steps), 6))
    roots[:, 0], roots[:, 1:3], roots[:, 5] = chart, places, mesh.turns[triangles]
    spots: FloatArray = (shares[:, :, None] * mesh.corners[triangles]).sum(axis=1)
    return Centres(triangles, shares, roots, spots)


class Regions:
    """Cubes of space, and which blocks lie in each.

    Attributes
    ----------
    side
        Of a cube, in model units.
    """

    def __init__(self, block: float) -> None:
        """Begin, with blocks so many model units wide."""
        self.side = _REGION * block
        self._parts: dict[tuple[int, int, int], list[tuple[int, int]]] = {}

    def enter(self, spots: FloatArray, first: int) -> tuple[NDArray[np.intp], list[list[tuple[int, int]]]]:
        """Enter blocks; return their order, and of each class the regions, as blocks from, to, in that order.

        They are numbered from `first` on, in the order returned.
        """
        cubes = np.floor(spots / self.side).astype(np.int64)
        kind = (cubes & 1) @ np.array([1, 2, 4])
        order = np.lexsort((np.arange(len(spots)), *cubes.T[::-1], kind))
        cubes, kind = cubes[order], kind[order]
        new = np.flatnonzero((np.diff(cubes, axis=0, prepend=cubes[:1] - 1) != 0).any(axis=1))
        stops = [*new[1:].tolist(), len(order)]
        classes: list[list[tuple[int, int]]] = [[] for _ in range(8)]
        for start, stop in zip(new.tolist(), stops, strict=True):
            part = (first + start, first + stop)
            a, b, c = cubes[start].tolist()
            self._parts.setdefault((a, b, c), []).append(part)
            classes[int(kind[start])].append(part)
        return order, [one for one in classes if one]

    def near(self, spot: FloatArray) -> NDArray[np.int64]:
        """Return the blocks in the cubes round a place, (k, 2) from, to."""
        a, b, c = np.floor(spot / self.side).astype(np.int64).tolist()
        found = [
            part
            for i in (a - 1, a, a + 1)
            for j in (b - 1, b, b + 1)
            for k in (c - 1, c, c + 1)
            for part in self._parts.get((i, j, k), ())
        ]
        return np.array(sorted(found), np.int64).reshape(-1, 2)


def _shares(flat: FloatArray, places: FloatArray) -> FloatArray:
    # Barycentric coordinates of places in triangles (n, 3, 2), brought into them.
    first, second, to = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], places - flat[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    b = np.maximum((to[:, 0] * second[:, 1] - to[:, 1] * second[:, 0]) / area, 0)
    c = np.maximum((first[:, 0] * to[:, 1] - first[:, 1] * to[:, 0]) / area, 0)
    total = np.maximum(b + c, 1.0)
    out: FloatArray = np.stack([1 - (b + c) / total, b / total, c / total], axis=1)
    return out
