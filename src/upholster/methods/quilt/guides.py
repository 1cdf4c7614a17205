"""What blocks are asked to show where: guides, the sample's zones, and what is kept of another quilt.

A guide is a map of the sample beside a map of the surface: a block's pixels shall be by the one what the
steps that they cover are by the other. So a sample that rusts from left to right rusts where the surface
says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._block_kernels import EITHER
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.putting import PutPiece
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.pyramid import halved
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray

__all__ = [
    "EITHER",
    "MOST_ZONES",
    "Again",
    "Asked",
    "Guide",
    "Rectangle",
    "Steering",
    "Zones",
    "as_guide",
    "cropped",
    "guide_costs",
    "level_guides",
    "on_charts",
]

_WORTH = 8.0
"""What a guide of weight 1 costs a pixel that is off by all of its range, in variances of the sample."""

_RANGE = 254
"""Between the least and the greatest number of a guide, 1 and 255."""

ChartBytes = tuple[NDArray[np.uint8], ...]
"""Of each chart (height, width)."""

Rectangle = tuple[int, int, int, int]
"""Row, column, height and width."""

MOST_ZONES = 16


@dataclass(frozen=True, eq=False, slots=True)
class Guide:
    """A map of the sample beside one of the surface.

    Attributes
    ----------
    shown
        (H, W) what the sample's pixels are, 1 to 255.
    wanted
        Of each chart (height, width) what its steps shall be, 1 to 255; 0: nothing is asked.
    weight
        How much it counts; 1 is usual.
    is_label
        Whether numbers are names: they are the same, or they are not.
    """

    shown: NDArray[np.uint8]
    wanted: ChartBytes
    weight: float = 1.0
    is_label: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Zones:
    """Which of several samples lies where. They are rectangles of one image.

    Attributes
    ----------
    rectangles
        Of each sample. Zone 1 is the first one's.
    wanted
        Of each chart (height, width) which zone its steps shall show; with `EITHER` blocks of another may
        reach in.
    phases
        Of each zone, where in its periods its sample shall be.
    """

    rectangles: tuple[Rectangle, ...]
    wanted: ChartBytes
    phases: tuple[WantedPhases | None, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Steering:
    """All that blocks are asked for.

    Attributes
    ----------
    guides, zones
        See there; no zones: None.
    kept
        A quilt of the same sample and charts, and of each chart (height, width) where it stays; None:
        nothing.
    put
        Pieces of the sample that lie where they were put.
    """

    guides: tuple[Guide, ...] = ()
    zones: Zones | None = None
    kept: tuple[Quilt, tuple[NDArray[np.bool_], ...]] | None = None
    put: tuple[PutPiece, ...] = ()

    def on_charts(self, before: Sequence[Chart], charts: Sequence[Chart]) -> "Steering":
        """Return the same for charts of longer steps, of the same faces; nothing is kept there."""
        guides = tuple(replace(one, wanted=on_charts(one.wanted, charts)) for one in self.guides)
        zones = self.zones and replace(self.zones, wanted=on_charts(self.zones.wanted, charts))
        return Steering(guides, zones, put=tuple(one.on_charts(before, charts) for one in self.put))


@dataclass(frozen=True, eq=False, slots=True)
class Again:
    """A region that is laid once more.

    Attributes
    ----------
    stays
        Of each chart (height, width) where nothing changes.
    seed
        With which it is laid.
    """

    stays: tuple[NDArray[np.bool_], ...]
    seed: int

    def on_charts(self, charts: Sequence[Chart]) -> "Again":
        """Return the same for charts of longer steps, of the same faces."""
        return Again(on_charts(self.stays, charts), self.seed)


@dataclass(frozen=True, eq=False, slots=True)
class Asked:
    """What canvases are told: of each chart.

    Attributes
    ----------
    wanted
        (K, height, width) what guides ask for.
    zones
        (height, width) which zone; empty: there are none.
    kept
        (height, width) int32: which pixel of the level is kept there, row · width + column, −1 for none;
        empty: nothing is.
    """

    wanted: ChartBytes
    zones: ChartBytes = ()
    kept: tuple[IntArray, ...] = ()

    @classmethod
    def of(cls, steering: Steering, charts: Sequence[Chart], level: int, shape: tuple[int, int]) -> "Asked":
        """Return what charts are told; a level of the sample has `shape` pixels."""
        wanted = [
            np.stack([guide.wanted[n] for guide in steering.guides])
            if steering.guides
            else np.zeros((0, chart.height, chart.width), np.uint8)
            for n, chart in enumerate(charts)
        ]
        zones = () if steering.zones is None else steering.zones.wanted
        kept: tuple[IntArray, ...] = ()
        if steering.kept is not None:
            quilt, stays = steering.kept
            kept = tuple(
                np.where(stay, _level_places(source, level, shape), -1).astype(np.int32)
                for source, stay in zip(quilt.sources(), stays, strict=True)
            )
        return cls(tuple(wanted), zones, kept)


@stage
def cropped(image: PixelArray, rectangle: Rectangle) -> PixelArray:
    """Return a rectangle of an image: one of the samples in it."""
    row, column, height, width = rectangle
    return np.ascontiguousarray(image[row : row + height, column : column + width])


def as_guide(values: FloatArray | NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return numbers of a guide, 1 to 255, of values 0…1; 0 where a value is NaN."""
    asked = np.isfinite(values)
    unit = np.clip(np.where(asked, values, 0.0), 0.0, 1.0)
    return np.where(asked, np.rint(1 + _RANGE * unit), 0).astype(np.uint8)


def level_guides(guides: Sequence[Guide], level: int, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return what a level's pixels are by each guide, (K, height · width); labels are not averaged."""
    out = np.empty((len(guides), shape[0] * shape[1]), np.uint8)
    for row, guide in zip(out, guides, strict=True):
        shown = guide.shown[:, :, None]
        for _ in range(level):
            shown = shown[::2, ::2] if guide.is_label else halved(np.ascontiguousarray(shown))
        row[:] = np.maximum(shown.reshape(-1), 1)
    return out


def guide_costs(guides: Sequence[Guide], variance: float) -> IntArray:
    """Return what a pixel pays for each guide and difference, (K, 256), in squares of matched channels."""
    off = np.arange(256) / _RANGE
    rows = [
        guide.weight * _WORTH * variance * (np.minimum(np.arange(256), 1) if guide.is_label else off**2)
        for guide in guides
    ]
    found: IntArray = np.rint(np.array(rows).reshape(-1, 256)).astype(np.int32)
    return found


def on_charts(arrays: Sequence[NDArray[Any]], charts: Sequence[Chart]) -> tuple[NDArray[Any], ...]:
    """Return arrays (height, width) of charts for those of other steps: what lies in their middles."""
    found = []
    for array, chart in zip(arrays, charts, strict=True):
        rows, columns = (
            ((np.arange(count) + 0.5) * size / count).astype(np.int64)
            for count, size in zip((chart.height, chart.width), array.shape, strict=True)
        )
        found.append(np.ascontiguousarray(array[rows[:, None], columns]))
    return tuple(found)


def _level_places(source: IntArray, level: int, shape: tuple[int, int]) -> IntArray:
    # Of places in 1/16 pixel the pixel of a level in which they lie.
    pixel = np.clip((source + 8) >> (4 + level), 0, np.array(shape) - 1)
    found: IntArray = pixel[..., 0] * shape[1] + pixel[..., 1]
    return found
