"""What a stream may ask for, checked before masks are made or anything is painted (SPEC.md, section 9)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.codec import ImageHeader
from upholster.errors import FormatError
from upholster.limits import Limits
from upholster.quilt import Chart
from upholster.methods.quilt.masked import MASK_CUT, ChartSizes, chart_sizes, mask_windows
from upholster.methods.quilt.old_plans import StripLayout

__all__ = ["PaintBudget", "check_charts", "check_samples", "painting_work", "strips_work"]

_A_TEXEL = 4
"""Units of work for a texel that a block covers; each pass over a texel of a mask's window is one."""

_FREE_WORK = 2**26
_CELLS_A_TEXEL, _FREE_CELLS = 4, 2**22


def check_charts(charts: Sequence[Chart], limits: Limits) -> None:
    """Raise FormatError for more charts or texels than the limits."""
    if len(charts) > limits.of("charts"):
        raise FormatError(f"layout has {len(charts)} charts; allowed here: {limits.charts}")
    texels = _texels(charts)
    if texels > limits.texels:
        raise FormatError(f"layout has {texels} texels; allowed here: {limits.texels}")


def check_samples(headers: Sequence[ImageHeader], limits: Limits) -> None:
    """Raise FormatError for more samples, over all maps, than the limits."""
    samples = sum(header.height * header.width * header.channels for header in headers)
    if samples > limits.of("samples"):
        raise FormatError(f"maps have {samples} samples; allowed here: {limits.samples}")


def painting_work(placed: NDArray[np.void], charts: ChartSizes) -> int:
    """Return how many units of work placements take.

    4 for each texel that one covers of its chart; where it has a cut mask, 1 for each texel of the mask's
    window, and 1 for each pass of feathering over it.

    Parameters
    ----------
    placed
        (n,) of `PLACEMENT`; masks need not have come.
    charts
        The layout.
    """
    sizes = chart_sizes(charts)
    windows = mask_windows(placed, sizes)
    cell = placed["mask_cell"].astype(np.int64)
    covered, masked = np.ones(len(placed), np.int64), np.ones(len(placed), np.int64)
    for axis, (at, extent) in enumerate((("row", "height"), ("column", "width"))):
        length = placed[extent].astype(np.int64)
        low = placed[at].astype(np.int64) - length // 2
        covered *= np.maximum(0, np.minimum(low + length, sizes[placed["chart"], axis]) - np.maximum(low, 0))
        first, end = windows[:, 2 * axis], windows[:, 2 * axis + 1]
        masked *= np.maximum(0, np.minimum(end * cell, length) - first * cell)
    passes = 1 + placed["feather"].astype(np.int64)
    work = _A_TEXEL * covered + np.where(placed["mask"] == MASK_CUT, masked * passes, 0)
    return int(work.sum())


def strips_work(layout: StripLayout) -> int:
    """Return how many units of work the strips of a plan take: all of each block counts, on both its charts.

    Of a chart's own blocks at most four lie on a texel: they count for nothing.
    """
    blocks = layout.count - int(layout.runs[len(layout.charts), 0])
    return 2 * blocks * layout.edge_block**2 * (_A_TEXEL + 1 + layout.feather)


class PaintBudget:
    """The work that a plan's placements may take, for one map and for all maps together.

    A map of c channels takes (1 + c) / 4 of the work that is told: one of three channels takes all of it.
    What all maps take together goes with the texels that the caller allows, whatever the stream has.

    Parameters
    ----------
    charts
        The layout.
    limits
        The caller's.
    """

    def __init__(self, charts: Sequence[Chart], limits: Limits) -> None:
        self._sizes = chart_sizes(charts)
        texels = _texels(charts)
        self._most = limits.work * texels + _FREE_WORK
        self._most_together = limits.work * limits.texels + _FREE_WORK
        self._most_cells = _CELLS_A_TEXEL * texels + _FREE_CELLS
        self._spent = 0
        self._shares = 0  # quarters of the work that all maps take

    def add_map(self, channels: int) -> None:
        """Count a further map of so many channels; raises FormatError where all are too much."""
        self._shares += 1 + channels
        self._check()

    def spend(self, placed: NDArray[np.void]) -> None:
        """Take what placements cost; raises FormatError where it is too much."""
        self.take(painting_work(placed, self._sizes))

    def take(self, work: int) -> None:
        """Take so many units of work; raises FormatError where it is too much."""
        self._spent += work
        self._check()

    def _check(self) -> None:
        together = self._spent * self._shares // 4
        for what, work, most in (
            ("placements", self._spent, self._most),
            ("all maps", together, self._most_together),
        ):
            if work > most:
                raise FormatError(f"{what} take {work} units of work or more; allowed here: {most}")

    def check_cells(self, cells: int) -> None:
        """Raise FormatError for more cells of masks than go with the texels."""
        if cells > self._most_cells:
            raise FormatError(f"masks have {cells} cells; allowed here: {self._most_cells}")


def _texels(charts: Sequence[Chart]) -> int:
    return sum(chart.height * chart.width for chart in charts)
