"""The positions of blocks' centres."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.mesh_layout import GUTTER
from upholster.charts.size_map import SizeField
from upholster.runtime.parallel import check_cancelled
from upholster.synthesis.quilt.ground import PlacedGround
from upholster.synthesis.quilt.kernels._frame_kernels import nearest_steps

__all__ = ["Centres", "centres_at", "centres_on", "centres_on_grids"]

_SIZES = 3.0
"""Number of grids for each octave of block sizes, where sizes differ."""


@dataclass(frozen=True, eq=False, slots=True)
class Centres:
    """The centres of n blocks: each is a step of a chart.

    Attributes
    ----------
    steps
        (n, 3) int32: chart, row and column; the other attributes follow from them.
    triangles
        (n,) int32: the triangle of the ground's mesh that contains the step or is right next to it; −1: not
        on the ground.
    roots
        (n, 6): the chart; row and column of the step in the chart's window; the position that the step reads
        minus the block's source, in frame pixels (2); and the quarter turns from the chart's matrix there to
        the block's.
    spots
        (n, 3) positions in space, in the triangles' planes.
    """

    steps: IntArray
    triangles: IntArray
    roots: FloatArray
    spots: FloatArray

    def chosen(self, order: NDArray[Any]) -> "Centres":
        """Return the centres that `order` lists, in that order."""
        parts = (self.steps, self.triangles, self.roots, self.spots)
        return Centres(*(part[order] for part in parts))

    def with_more(self, others: "Centres") -> "Centres":
        """Return these centres, followed by others."""
        names = ("steps", "triangles", "roots", "spots")
        return Centres(*(np.concatenate([getattr(part, name) for part in (self, others)]) for name in names))


def centres_at(placed: PlacedGround, steps: IntArray) -> Centres:
    """Return charts' steps (n, 3) as centres."""
    mesh, canvases = placed.ground.mesh, placed.ground.canvases
    chart = steps[:, 0]
    at = steps[:, 1:] - placed.corners[chart]
    heights, widths = canvases.heights[chart], canvases.widths[chart]
    inside = (at >= 0).all(axis=1) & (at[:, 0] < heights) & (at[:, 1] < widths)
    number = canvases.firsts[chart] + at[:, 0] * widths + at[:, 1]
    triangles = np.full(len(steps), -1, np.int32)
    triangles[inside] = canvases.triangles[number[inside]]
    shares = _shares(mesh.places[triangles], at.astype(np.float64))
    roots = np.zeros((len(steps), 6))
    roots[:, 0], roots[:, 1:3], roots[:, 5] = chart, at, mesh.turns[triangles]
    spots: FloatArray = (shares[:, :, None] * mesh.corners[triangles]).sum(axis=1)
    return Centres(steps, triangles, roots, spots)


def centres_on(
    placed: PlacedGround, wanted: NDArray[np.bool_], step: float, shift: float, *, bare: bool
) -> Centres:
    """Return centres on even grids over the charts, `step` steps apart, the first one at `shift`.

    Each centre is the step on the surface nearest to a point of the grid; centres in triangles that are not
    `wanted` (T,) are left out. With `bare`, only steps in wanted triangles that show no block are candidates.
    """
    canvases = placed.ground.canvases
    looked_at = wanted if bare else np.ones(len(wanted), np.bool_)
    charts = np.flatnonzero(canvases.heights * canvases.widths)
    corners, shapes = placed.corners[charts], np.stack([canvases.heights, canvases.widths], axis=1)[charts]
    last = np.maximum(((placed.sizes[charts] - shift) / step + 0.5).astype(np.int64), 0)
    low, high = (
        np.clip(((at - shift) / step + 0.5).astype(np.int64), 0, last)
        for at in (corners, corners + shapes - 1)
    )
    grids, parts = np.stack([corners, low, last], axis=1), [np.zeros(0, np.int32)]
    for chart, counts, grid in zip(charts.tolist(), (high - low + 1).tolist(), grids, strict=True):
        check_cancelled()
        away, found = np.empty(counts), np.empty(counts, np.int32)
        nearest_steps(canvases, chart, looked_at.view(np.uint8), bare, step, shift, grid, away, found)
        parts.append(found[found >= 0])
    at = np.repeat(np.arange(len(charts)), [len(part) for part in parts[1:]])
    within = np.stack(np.divmod(np.concatenate(parts).astype(np.int64), shapes[at, 1]), axis=1)
    steps = np.concatenate([charts[at, None], within + corners[at]], axis=1)
    found_all = centres_at(placed, steps.astype(np.int32))
    return found_all.chosen(np.flatnonzero(wanted[found_all.triangles]))


def centres_on_grids(
    placed: PlacedGround, own: NDArray[np.bool_], step: float, sizes: SizeField | None
) -> Centres:
    """Return centres in the triangles `own` (T,), `step` steps apart times the sample's size there."""
    if sizes is None:
        return centres_on(placed, own, step, GUTTER + 0.35 * step, bare=False)
    middles = placed.ground.mesh.corners.mean(axis=1)
    finer = np.rint(np.log2(sizes.at(placed.parent, middles)) * _SIZES).astype(np.int64)
    found = centres_at(placed, np.zeros((0, 3), np.int32))
    for number in np.unique(finer[own]).tolist():
        wide = max(2.0, step * 2.0 ** (number / _SIZES))
        part = centres_on(placed, own & (finer == number), wide, GUTTER + 0.35 * wide, bare=False)
        found = found.with_more(part)
    return found


def _shares(flat: FloatArray, places: FloatArray) -> FloatArray:
    # Barycentric coordinates of places in triangles (n, 3, 2), or next to them. A narrow triangle defines its
    # plane poorly, so places next to it are moved closer: coordinates are at least −1.
    first, second, to = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], places - flat[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    b = np.maximum((to[:, 0] * second[:, 1] - to[:, 1] * second[:, 0]) / area, -1)
    c = np.maximum((first[:, 0] * to[:, 1] - first[:, 1] * to[:, 0]) / area, -1)
    total = np.maximum(0.5 * (b + c), 1.0)
    out: FloatArray = np.stack([1 - (b + c) / total, b / total, c / total], axis=1)
    return out
