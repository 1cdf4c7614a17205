"""The plan of method "pixel": for each texel of each chart, the pixel of the exemplar that it shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.quilt.chart import Chart
from upholster.methods.quilt.masked import PLACEMENT

__all__ = ["SourceMap"]


@dataclass(frozen=True, eq=False, slots=True)
class SourceMap:
    """A source for each texel.

    Attributes
    ----------
    sources
        Per chart, (height, width, 2) integers: row and column in the exemplar, in pixels.
    """

    sources: tuple[NDArray[np.int16], ...]

    def placements(self, charts: Sequence[Chart]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
        """Return one placement for each run of texels in a row that are neighbours in the exemplar too.

        Raises
        ------
        InputError
            If the map has not one array of each chart's height and width.
        """
        wanted = [(chart.height, chart.width, 2) for chart in charts]
        if [part.shape for part in self.sources] != wanted:
            raise InputError("a source map needs an array (height, width, 2) for each chart")
        parts = [_runs(n, part) for n, part in enumerate(self.sources)]
        return np.concatenate([np.zeros(0, PLACEMENT), *parts]), np.zeros(0, np.uint8)


def _runs(chart: int, sources: NDArray[np.int16]) -> NDArray[np.void]:
    step = np.diff(sources, axis=1)
    begins = np.ones(sources.shape[:2], bool)
    begins[:, 1:] = (step[:, :, 0] != 0) | (step[:, :, 1] != 1)
    rows, columns = np.nonzero(begins)
    width = sources.shape[1]
    first = rows * width + columns
    lengths = np.diff(first, append=sources.shape[0] * width)
    out = np.zeros(len(rows), PLACEMENT)
    out["chart"], out["row"], out["column"] = chart, rows, columns + lengths // 2
    out["height"], out["width"] = 1, lengths
    out["source_row"] = 16 * sources[rows, columns, 0].astype(np.int32)
    out["source_column"] = 16 * (sources[rows, columns, 1] + lengths // 2)
    out["first_cell"] = -1
    return out
