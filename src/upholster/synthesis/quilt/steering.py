"""Requests to blocks, on charts: what they show at which steps, and which steps are kept from another quilt.

A guide is a map of the sample paired with a map of the surface. A block's pixels should have, in the first
map, the values that the second map has at the steps that they cover. So if a sample rusts from left to right,
the surface's map controls where rust is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.pyramid import halved
from upholster.synthesis.exemplar import Guide
from upholster.synthesis.quilt.kernels._block_kernels import EITHER, LayNumbers
from upholster.synthesis.quilt.puts import PutPiece

__all__ = ["EITHER", "MOST_ZONES", "Steering", "as_guide", "guide_costs", "level_guides"]

_WORTH = 8.0
"""Cost of a pixel that is off by a guide's full range, for weight 1, in variances of the sample."""

_RANGE = 254
"""Difference of the least and the greatest value of a guide, 1 and 255."""

MOST_ZONES = 16

_Masks = tuple[NDArray[np.bool_], ...]
"""For each chart (height, width)."""


@dataclass(frozen=True, eq=False, slots=True)
class Steering:
    """All placement requests as blocks need them: arrays over the steps of charts.

    Attributes
    ----------
    wanted
        For each chart (K, height, width) the values that K guides request, 1 to 255; 0: no request. Empty:
        there are no guides.
    zones
        For each chart (height, width) the sample that its steps should show, 1 for the first. At steps with
        `EITHER` added, blocks of another one may show. Empty: there is one sample.
    put
        Pieces of the sample at places that the user chose.
    again
        Regions that are laid again, one after another: the steps that do not change, and the seed.
    held
        The steps that `holding` keeps; empty: none.
    kept
        A quilt of the same sample and charts, and the steps that keep it; None: no steps.
    differs
        Whether other steps must differ from that quilt.
    """

    wanted: tuple[NDArray[np.uint8], ...] = ()
    zones: tuple[NDArray[np.uint8], ...] = ()
    put: tuple[PutPiece, ...] = ()
    again: tuple[tuple[_Masks, int], ...] = ()
    held: _Masks = ()
    kept: tuple[Quilt, _Masks] | None = None
    differs: bool = False

    def on_charts(self, before: Sequence[Chart], charts: Sequence[Chart]) -> "Steering":
        """Return the same requests for charts of the same faces with longer steps, but without kept steps."""
        return Steering(
            _on_charts(self.wanted, charts),
            _on_charts(self.zones, charts),
            tuple(one.on_charts(before, charts) for one in self.put),
            tuple((_on_charts(stays, charts), seed) for stays, seed in self.again),
            _on_charts(self.held, charts),
        )

    def holding(self, quilt: Quilt) -> "Steering":
        """Return the same requests, with steps in `held` kept from a quilt, also by regions laid again."""
        again = tuple(
            (tuple(own | held for own, held in zip(stays, self.held, strict=True)), seed)
            for stays, seed in self.again
        )
        return replace(self, kept=(quilt, self.held), again=again)

    def places(self, numbers: LayNumbers) -> tuple[IntArray, ...]:
        """Return what each kept step shows, for each chart (height, width); empty: no steps are kept.

        It is the pixel n of the sample as in `numbers`, row · width + column; −1 − n for steps that must not
        show it; −1 for others.
        """
        if self.kept is None:
            return ()
        quilt, stays = self.kept
        return tuple(
            np.where(stay, places, -1 - places if self.differs else -1).astype(np.int32)
            for places, stay in zip(
                (_level_places(source, numbers) for source in quilt.sources()), stays, strict=True
            )
        )


def as_guide(values: FloatArray | NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert values 0…1 to the values of a guide, 1 to 255; NaN becomes 0."""
    asked = np.isfinite(values)
    unit = np.clip(np.where(asked, values, 0.0), 0.0, 1.0)
    return np.where(asked, np.rint(1 + _RANGE * unit), 0).astype(np.uint8)


def level_guides(guides: Sequence[Guide], level: int, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the values of a level's pixels in each guide, (K, height · width); labels are not averaged."""
    out = np.empty((len(guides), shape[0] * shape[1]), np.uint8)
    for row, guide in zip(out, guides, strict=True):
        shown = guide.shown[:, :, None]
        for _ in range(level):
            shown = shown[::2, ::2] if guide.labels is not None else halved(np.ascontiguousarray(shown))
        row[:] = np.maximum(shown.reshape(-1), 1)
    return out


def guide_costs(guides: Sequence[Guide], variance: float) -> IntArray:
    """Return the cost of a pixel for each guide and difference, (K, 256), in squares of matched channels."""
    off = np.arange(256) / _RANGE
    rows = [
        guide.weight * _WORTH * variance * (off**2 if guide.labels is None else np.minimum(np.arange(256), 1))
        for guide in guides
    ]
    found: IntArray = np.rint(np.array(rows).reshape(-1, 256)).astype(np.int32)
    return found


def _on_charts(arrays: Sequence[NDArray[Any]], charts: Sequence[Chart]) -> tuple[NDArray[Any], ...]:
    # Arrays (…, height, width) of charts, if there are any, for charts of other steps: values at the steps'
    # centres.
    found = []
    for array, chart in zip(arrays, charts if arrays else (), strict=True):
        rows, columns = (
            ((np.arange(count) + 0.5) * size / count).astype(np.int64)
            for count, size in zip((chart.height, chart.width), array.shape[-2:], strict=True)
        )
        found.append(np.ascontiguousarray(array[..., rows[:, None], columns]))
    return tuple(found)


def _level_places(source: IntArray, numbers: LayNumbers) -> IntArray:
    # The pixel of a level that contains each place; places are in 1/16 pixel.
    fringe, shape = numbers.fringe, np.array([numbers.height, numbers.width])
    pixel = np.clip(((source + 8) >> (4 + numbers.level)) + fringe, fringe, shape - fringe - 1)
    found: IntArray = pixel[..., 0] * numbers.width + pixel[..., 1]
    return found
