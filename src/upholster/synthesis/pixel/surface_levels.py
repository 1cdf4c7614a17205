"""The texels of all charts on one level, each chart with a frame of texels from adjacent charts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.charts.chart_seams import find_seams
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.synthesis.pixel._pixel_kernels import REACH

__all__ = ["SurfaceLevel"]


@dataclass(frozen=True, eq=False)
class SurfaceLevel:
    """The layout of all charts' texels of a level in one flat array.

    Attributes
    ----------
    charts
        Charts of this level: each half as high and wide as on the finer one, rounded up.
    firsts, strides
        Texel (r, c) of chart n is number ``firsts[n] + r·strides[n] + c``.
    count
        Number of all texels, frames included.
    frame, beyond
        (n,) int64: texels of frames, and the texels of other charts at the same places. A frame has no texels
        across a border or a degenerate edge, nor in its corners.
    frame_firsts
        (charts + 1,) int64: where each chart's part of `frame` begins, and where the last one ends.
    """

    charts: tuple[Chart, ...]
    firsts: tuple[int, ...]
    strides: tuple[int, ...]
    count: int
    frame: NDArray[np.int64]
    beyond: NDArray[np.int64]
    frame_firsts: NDArray[np.int64]

    @property
    def texels(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)

    @classmethod
    def of(cls, surface: Surface, charts: Sequence[Chart], level: int) -> "SurfaceLevel":
        """Lay out one level of some charts; 0 is the finest."""
        tile = 2**level
        mine = tuple(
            replace(chart, height=-(-chart.height // tile), width=-(-chart.width // tile)) for chart in charts
        )
        strides = tuple(chart.width + 2 * REACH for chart in mine)
        sizes = [(chart.height + 2 * REACH) * stride for chart, stride in zip(mine, strides, strict=True)]
        ends = np.cumsum([0, *sizes])
        firsts = tuple((ends[:-1] + [REACH * stride + REACH for stride in strides]).tolist())
        frame, beyond = _frames(surface, mine, firsts, strides)
        order = np.argsort(frame, kind="stable")
        frame, beyond = frame[order], beyond[order]
        return cls(mine, firsts, strides, int(ends[-1]), frame, beyond, np.searchsorted(frame, ends))

    def refresh(self, sources: IntArray) -> None:
        """Copy the charts' current content to all frames."""
        sources[self.frame] = sources[self.beyond]

    def refresh_chart(self, sources: IntArray, index: int) -> None:
        """Copy the charts' current content to the frame of one chart."""
        own = slice(self.frame_firsts[index], self.frame_firsts[index + 1])
        sources[self.frame[own]] = sources[self.beyond[own]]

    def on_chart(self, sources: IntArray, index: int) -> IntArray:
        """Return chart `index` of a flat array, without its frame: (height, width), a view."""
        chart, stride = self.charts[index], self.strides[index]
        first = self.firsts[index] - REACH
        return sources[first : first + chart.height * stride].reshape(-1, stride)[:, REACH:-REACH]


def _frames(
    surface: Surface, charts: Sequence[Chart], firsts: Sequence[int], strides: Sequence[int]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    # Texels of frames, and the texels on other charts at the same places: equally far from the edge.
    frame, beyond = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for seam in find_seams(surface, charts):
        along = np.arange(np.ceil(seam.start - 0.5), np.ceil(seam.stop - 0.5), dtype=np.float64)
        share = (along + 0.5 - seam.start) / (seam.stop - seam.start)
        met = np.floor((1 - share) * seam.other_start + share * seam.other_stop)
        for depth in range(REACH):
            row, column = _along_edge(charts[seam.chart], seam.edge, along, -1 - depth)
            frame.append(firsts[seam.chart] + row * strides[seam.chart] + column)
            other, size = seam.other_chart, charts[seam.other_chart]
            row, column = _along_edge(size, seam.other_edge, met, depth)
            row, column = row.clip(0, size.height - 1), column.clip(0, size.width - 1)
            beyond.append(firsts[other] + row * strides[other] + column)
    return np.concatenate(frame), np.concatenate(beyond)


def _along_edge(
    chart: Chart, edge: int, along: FloatArray, depth: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    # Rows and columns of texels along an edge of a chart, `depth` texels inward from it.
    last = (0, chart.width - 1, chart.height - 1, 0)[edge]
    across = np.full(len(along), depth if edge in (0, 3) else last - depth, np.int64)
    places = along.astype(np.int64)
    return (places, across) if edge & 1 else (across, places)
