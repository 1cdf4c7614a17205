"""The texels of all charts on one level, each chart with a frame of texels of the charts beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.charts.seams import ChartSeam, find_seams
from upholster.charts.transitions import transitions
from upholster.geometry import Surface
from upholster.methods.pixel._pixel_kernels import REACH
from upholster.quilt.chart import Chart
from upholster.types import FloatArray, IntArray

__all__ = ["SurfaceLevel"]


@dataclass(frozen=True, eq=False)
class SurfaceLevel:
    """Where all charts' texels of a level lie in one flat array.

    Attributes
    ----------
    charts
        On this level: each half as high and wide as on the finer one, rounded up.
    seams
        How they meet.
    firsts, strides
        Texel (r, c) of chart n is number ``firsts[n] + r·strides[n] + c``.
    count
        Of all texels, those of the frames included.
    frame, beyond
        (n,) int64: texels of frames, and the texels on other charts that lie there. Of a frame's texels
        there are none behind a border or a degenerate edge, nor in its corners.
    frame_firsts
        (charts + 1,) int64: where each chart's part of `frame` begins, and where the last one ends.
    """

    charts: tuple[Chart, ...]
    seams: tuple[ChartSeam, ...]
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
        seams = find_seams(surface, mine)
        frame, beyond = _frames(surface, mine, seams, np.array(firsts), np.array(strides))
        order = np.argsort(frame, kind="stable")
        frame, beyond = frame[order], beyond[order]
        return cls(mine, seams, firsts, strides, int(ends[-1]), frame, beyond, np.searchsorted(frame, ends))

    def refresh(self, sources: IntArray) -> None:
        """Copy to all frames what the charts hold now."""
        sources[self.frame] = sources[self.beyond]

    def refresh_chart(self, sources: IntArray, index: int) -> None:
        """Copy to the frame of one chart what the charts hold now."""
        own = slice(self.frame_firsts[index], self.frame_firsts[index + 1])
        sources[self.frame[own]] = sources[self.beyond[own]]

    def on_chart(self, sources: IntArray, index: int) -> IntArray:
        """Return chart `index` of a flat array, without its frame: (height, width), a view."""
        chart, stride = self.charts[index], self.strides[index]
        first = self.firsts[index] - REACH
        return sources[first : first + chart.height * stride].reshape(-1, stride)[:, REACH:-REACH]


def _frames(
    surface: Surface,
    charts: Sequence[Chart],
    seams: Sequence[ChartSeam],
    firsts: NDArray[np.int64],
    strides: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    frame, beyond = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for transition in transitions(surface, charts, seams):
        seam = transition.seam
        here, other = charts[seam.chart], charts[seam.other_chart]
        along: FloatArray = np.arange(np.ceil(seam.start - 0.5), np.ceil(seam.stop - 0.5), dtype=np.float64)
        # On edges 0 and 3 the frame lies before the first line, on 1 and 2 behind the last one.
        last = {0: -1, 1: here.width, 2: here.height, 3: -1}[seam.edge]
        out = -1 if seam.edge in (0, 3) else 1
        across: FloatArray = last + out * np.arange(REACH, dtype=np.float64)
        places: list[FloatArray] = [part.ravel() for part in np.meshgrid(along, across)]
        rows, columns = places if seam.edge & 1 else places[::-1]
        there_rows, there_columns, _ = transition.apply(rows, columns)
        sound = np.isfinite(there_rows) & np.isfinite(there_columns)
        there_rows = np.rint(there_rows[sound]).clip(0, other.height - 1).astype(np.int64)
        there_columns = np.rint(there_columns[sound]).clip(0, other.width - 1).astype(np.int64)
        rows, columns = rows[sound].astype(np.int64), columns[sound].astype(np.int64)
        frame.append(firsts[seam.chart] + rows * strides[seam.chart] + columns)
        beyond.append(firsts[seam.other_chart] + there_rows * strides[seam.other_chart] + there_columns)
    return np.concatenate(frame), np.concatenate(beyond)
