"""Windows of a textured model, unfolded around points as blocks are: what a flat sheet would show there.

The triangle around a point is laid in its own plane. Other vertices follow by their distance. Each is placed,
with true lengths, by a triangle whose other two corners are placed: an exponential map by unfolding.
"""

import heapq

import numpy as np
from numpy.typing import NDArray

from benchmarks.sheet_views import frames
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.creases import CREASE
from upholster.covering.measure.samples import bilinear
from upholster.output.glb_picture import ShownModel

__all__ = ["unfolded_windows"]

WINDOWS = 40
ENOUGH = 20
"""Windows of a size; and so many are enough for it to be used."""

Place = tuple[float, float]

BENT = 1.25
"""Where an edge is longer or shorter by more than this factor once laid flat, a window is left out."""


def unfolded_windows(
    model: ShownModel, pixel: float, direction: str, sides: tuple[int, ...] = (72, 56, 40)
) -> list[PixelArray]:
    """Return windows (side, side, 3) uint8 at the sample's scale, in the direction that was asked for.

    Parameters
    ----------
    model
        A file's triangles, with their texture.
    pixel
        The length of a pixel of the sample.
    direction
        As asked for: level or around:z.
    sides
        In pixels of the sample. The first is used of which enough windows are whole: without borders,
        singular points and creases.
    """
    mesh = _Mesh(model)
    places = list(zip(*frames(model, pixel, direction), strict=True))
    found: list[PixelArray] = []
    for side in sides:
        found = []
        for triangle, origin, frame in places:
            window = mesh.window(triangle, origin, frame / pixel, side, pixel)
            found += [] if window is None else [window]
            if len(found) == WINDOWS:
                break
        if len(found) >= ENOUGH:
            break
    return found


class _Mesh:
    def __init__(self, model: ShownModel) -> None:
        self.model = model
        points = model.corners.reshape(-1, 3)
        grain = 1e-5 * np.ptp(points, axis=0).max()
        _, numbers = np.unique(np.rint(points / grain).astype(np.int64), axis=0, return_inverse=True)
        self.vertices = numbers.reshape(-1, 3)
        order = np.argsort(numbers.ravel(), kind="stable")
        ends = np.bincount(numbers.ravel()).cumsum()
        # In lists: plain numbers are faster one by one.
        self.listed = self.vertices.tolist()
        self.around = [part.tolist() for part in np.split(order // 3, ends[:-1])]
        # Each corner's place over the opposite edge, in units of the edge: along it, and left of it.
        edge = np.roll(model.corners, -2, axis=1) - np.roll(model.corners, -1, axis=1)
        arm = model.corners - np.roll(model.corners, -1, axis=1)
        square = np.maximum((edge * edge).sum(axis=2), 1e-30)
        along = (edge * arm).sum(axis=2) / square
        left = np.linalg.norm(np.cross(edge, arm), axis=2) / square
        self.shapes = np.stack([along, left], axis=2).tolist()

    def window(
        self, triangle: int, origin: FloatArray, axes: FloatArray, side: int, pixel: float
    ) -> PixelArray | None:
        """Return the window around a point; None if it is not whole."""
        first = (self.model.corners[triangle] - origin) @ axes.T / pixel
        flat = self._unfold(triangle, first.tolist(), 0.75 * side)
        near = {triangle for vertex in flat for triangle in self.around[vertex]}
        shown = np.array([t for t in sorted(near) if all(vertex in flat for vertex in self.listed[t])])
        laid = np.array([[flat[vertex] for vertex in self.listed[t]] for t in shown])
        true = self.model.corners[shown] / pixel
        lengths = [np.linalg.norm(c - np.roll(c, 1, axis=1), axis=2) for c in (laid, true)]
        inside = (np.abs(laid) < side / 2).any(axis=(1, 2))
        bent = (lengths[0] > BENT * lengths[1] + 0.5) | (lengths[1] > BENT * lengths[0] + 0.5)
        whole = not bent[inside].any() and not self._is_creased(shown[inside])
        return self._drawn(shown, laid, side) if whole else None

    def _is_creased(self, shown: NDArray[np.int64]) -> bool:
        """Return whether two of some triangles meet at a crease, where texture starts again."""
        normal = np.cross(*np.moveaxis(np.diff(self.model.corners[shown], axis=1), 1, 0))
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        vertices = self.vertices[shown]
        edges = np.sort(np.stack([vertices, np.roll(vertices, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        order = np.lexsort(edges.T)
        met = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
        one, other = normal[order[1:][met] // 3], normal[order[:-1][met] // 3]
        return bool(((one * other).sum(axis=1) < np.cos(np.radians(CREASE))).any())

    def _unfold(self, triangle: int, corners: list[Place], reach: float) -> dict[int, Place]:
        """Return the places of the vertices of triangles within reach: pixels down and right of the point."""
        flat: dict[int, Place] = {}
        waiting = [
            (down * down + right * right, vertex, (down, right))
            for vertex, (down, right) in zip(self.listed[triangle], corners, strict=True)
        ]
        heapq.heapify(waiting)
        while waiting:
            _, vertex, place = heapq.heappop(waiting)
            if vertex in flat:
                continue
            flat[vertex] = place
            for t in self.around[vertex]:
                three = self.listed[t]
                third = [k for k in range(3) if three[k] not in flat]
                if len(third) == 1:
                    k = third[0]
                    (down, right), other = flat[three[k - 2]], flat[three[k - 1]]
                    along, left = self.shapes[t][k]
                    ahead, beside = other[0] - down, other[1] - right
                    share = -(down * ahead + right * beside) / max(ahead**2 + beside**2, 1e-30)
                    share = min(max(share, 0.0), 1.0)
                    if (down + share * ahead) ** 2 + (right + share * beside) ** 2 > reach * reach:
                        continue
                    # From outside, corners run against the clock, and rows run down.
                    at = (down + along * ahead - left * beside, right + along * beside + left * ahead)
                    heapq.heappush(waiting, (at[0] ** 2 + at[1] ** 2, three[k], at))
        return flat

    def _drawn(self, shown: NDArray[np.int64], laid: FloatArray, side: int) -> PixelArray | None:
        steps = np.arange(side) - (side - 1) / 2
        texel = np.full((side, side, 2), np.nan)
        for t, corner in zip(shown, laid, strict=True):
            low = np.maximum(np.ceil(corner.min(axis=0) - steps[0]), 0).astype(int)
            high = np.minimum(np.floor(corner.max(axis=0) - steps[0]), side - 1).astype(int) + 1
            if (low >= high).any():
                continue
            edges = (corner[1:] - corner[0]).T
            if abs(np.linalg.det(edges)) < 1e-9:
                continue
            where = np.stack(np.meshgrid(steps[low[0] : high[0]], steps[low[1] : high[1]], indexing="ij"))
            u, v = np.einsum("ij,jrc->irc", np.linalg.inv(edges), where - corner[0][:, None, None])
            inner = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6)
            uv = self.model.uv[t]
            place = uv[0] + u[..., None] * (uv[1] - uv[0]) + v[..., None] * (uv[2] - uv[0])
            texel[low[0] : high[0], low[1] : high[1]][inner] = place[inner]
        if np.isnan(texel).any():
            return None
        flat = texel.reshape(-1, 2) - 0.5
        seen = bilinear(self.model.color[:, :, :3], flat[:, 1], flat[:, 0]).reshape(side, side, 3)
        return np.rint(255 * seen).astype(np.uint8)
