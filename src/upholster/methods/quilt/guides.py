"""Requests of what blocks show at which steps: guides, the sample's zones, and steps kept from another quilt.

A guide is a map of the sample paired with a map of the surface. A block's pixels should have, in the first
map, the values that the second map has at the steps that they cover. So if a sample rusts from left to right,
the surface's map controls where rust is.
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
"""Cost of a pixel that is off by a guide's full range, for weight 1, in variances of the sample."""

_RANGE = 254
"""Difference of the least and the greatest value of a guide, 1 and 255."""

ChartBytes = tuple[NDArray[np.uint8], ...]
"""For each chart an array (height, width)."""

Rectangle = tuple[int, int, int, int]
"""Row, column, height and width."""

MOST_ZONES = 16


@dataclass(frozen=True, eq=False, slots=True)
class Guide:
    """A map of the sample paired with a map of the surface.

    Attributes
    ----------
    shown
        (H, W) the values of the sample's pixels, 1 to 255.
    wanted
        For each chart (height, width) the requested values of its steps, 1 to 255; 0: no request.
    weight
        The guide's weight; 1 is usual.
    is_label
        Whether values are labels, which are either equal or different.
    """

    shown: NDArray[np.uint8]
    wanted: ChartBytes
    weight: float = 1.0
    is_label: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Zones:
    """Several samples, which are rectangles of one image, and the zone of the surface that each covers.

    Attributes
    ----------
    rectangles
        The rectangle of each sample. Zone 1 belongs to the first one.
    wanted
        For each chart (height, width) the zone that its steps should show. At steps with `EITHER` added,
        blocks of another zone may show.
    phases
        The requested phases of each zone's sample.
    """

    rectangles: tuple[Rectangle, ...]
    wanted: ChartBytes
    phases: tuple[WantedPhases | None, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Steering:
    """All requests to blocks.

    Attributes
    ----------
    guides, zones
        See `Guide` and `Zones`; None: there are no zones.
    kept
        A quilt of the same sample and charts, and for each chart a mask (height, width) of the steps that
        keep it; None: no steps.
    put
        Pieces of the sample at places that the user chose.
    differs
        Whether other steps must differ from that quilt.
    """

    guides: tuple[Guide, ...] = ()
    zones: Zones | None = None
    kept: tuple[Quilt, tuple[NDArray[np.bool_], ...]] | None = None
    put: tuple[PutPiece, ...] = ()
    differs: bool = False

    def on_charts(self, before: Sequence[Chart], charts: Sequence[Chart]) -> "Steering":
        """Return the same requests for charts of the same faces with longer steps, but without kept steps."""
        guides = tuple(replace(one, wanted=on_charts(one.wanted, charts)) for one in self.guides)
        zones = self.zones and replace(self.zones, wanted=on_charts(self.zones.wanted, charts))
        return Steering(guides, zones, put=tuple(one.on_charts(before, charts) for one in self.put))


@dataclass(frozen=True, eq=False, slots=True)
class Again:
    """A region that is laid again.

    Attributes
    ----------
    stays
        For each chart a mask (height, width) of the steps that do not change.
    seed
        The seed of the new blocks.
    """

    stays: tuple[NDArray[np.bool_], ...]
    seed: int

    def on_charts(self, charts: Sequence[Chart]) -> "Again":
        """Return the same region for charts of the same faces with longer steps."""
        return Again(on_charts(self.stays, charts), self.seed)


@dataclass(frozen=True, eq=False, slots=True)
class Asked:
    """The requests in the form that canvases store: one array for each chart.

    Attributes
    ----------
    wanted
        (K, height, width) the values that the K guides request.
    zones
        (height, width) the requested zone; empty: there are no zones.
    kept
        (height, width) int32: the pixel n of the level that each kept step shows, row · width + column;
        −1 − n for steps that must not show it; −1 for others; empty: no steps are kept.
    """

    wanted: ChartBytes
    zones: ChartBytes = ()
    kept: tuple[IntArray, ...] = ()

    @classmethod
    def of(cls, steering: Steering, charts: Sequence[Chart], level: int, shape: tuple[int, int]) -> "Asked":
        """Return the requests on charts; `shape` is the height and width of the sample's level."""
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
                np.where(stay, places, -1 - places if steering.differs else -1).astype(np.int32)
                for places, stay in zip(
                    (_level_places(source, level, shape) for source in quilt.sources()), stays, strict=True
                )
            )
        return cls(tuple(wanted), zones, kept)


@stage
def cropped(image: PixelArray, rectangle: Rectangle) -> PixelArray:
    """Return a rectangle of an image, which is one of the samples in it."""
    row, column, height, width = rectangle
    return np.ascontiguousarray(image[row : row + height, column : column + width])


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
            shown = shown[::2, ::2] if guide.is_label else halved(np.ascontiguousarray(shown))
        row[:] = np.maximum(shown.reshape(-1), 1)
    return out


def guide_costs(guides: Sequence[Guide], variance: float) -> IntArray:
    """Return the cost of a pixel for each guide and difference, (K, 256), in squares of matched channels."""
    off = np.arange(256) / _RANGE
    rows = [
        guide.weight * _WORTH * variance * (np.minimum(np.arange(256), 1) if guide.is_label else off**2)
        for guide in guides
    ]
    found: IntArray = np.rint(np.array(rows).reshape(-1, 256)).astype(np.int32)
    return found


def on_charts(arrays: Sequence[NDArray[Any]], charts: Sequence[Chart]) -> tuple[NDArray[Any], ...]:
    """Resample arrays (height, width) of charts for charts of other steps: values at the steps' centres."""
    found = []
    for array, chart in zip(arrays, charts, strict=True):
        rows, columns = (
            ((np.arange(count) + 0.5) * size / count).astype(np.int64)
            for count, size in zip((chart.height, chart.width), array.shape, strict=True)
        )
        found.append(np.ascontiguousarray(array[rows[:, None], columns]))
    return tuple(found)


def _level_places(source: IntArray, level: int, shape: tuple[int, int]) -> IntArray:
    # The pixel of a level that contains each place; places are in 1/16 pixel.
    pixel = np.clip((source + 8) >> (4 + level), 0, np.array(shape) - 1)
    found: IntArray = pixel[..., 0] * shape[1] + pixel[..., 1]
    return found
