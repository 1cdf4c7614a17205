"""What a user asks of where things go, before it is known on which charts: guides and zones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.maps import MapGround, SurfaceMap, region
from upholster.errors import InputError
from upholster.geometry.mesh_files import ModelFile
from upholster.methods.quilt.guides import EITHER, Again, Guide, Rectangle, as_guide
from upholster.stages import stage
from upholster.types import IntArray

__all__ = ["Guidance", "GuidePair", "Shown", "ZoneMaps", "guides_on", "region_again", "zones_on"]

_LISTED = 6
"""Labels that an error lists."""

_MOST_LABELS = 254

_BLENDED = 3
"""Steps that blocks are blended over, at most: a region that is laid once more is so much smaller, for all
else to stay as it is."""

_BAND = 8
"""Where zones meet, blocks of either may reach in by this part of their side."""


Shown = NDArray[np.float32] | IntArray
"""What a sample's pixels are, (H, W): values 0…1, or labels."""


@dataclass(frozen=True, eq=False)
class GuidePair:
    """A map of the sample beside one of the surface.

    Attributes
    ----------
    text
        As the user wrote it.
    shown
        (H, W) what the sample's pixels are: values 0…1, or labels 0xRRGGBB.
    wanted
        What the surface shall be.
    weight
        How much it counts; 1 is usual.
    is_label
        Whether they are labels: the same, or not.
    """

    text: str
    shown: Shown
    wanted: SurfaceMap
    weight: float = 1.0
    is_label: bool = False


@dataclass(frozen=True, eq=False)
class ZoneMaps:
    """Which of several samples in one image lies where.

    Attributes
    ----------
    rectangles
        Where each sample lies in the image; the first one lies where no map asks for another.
    wanted
        For each of the others, where it is asked for: of several the last one counts.
    """

    rectangles: tuple[Rectangle, ...]
    wanted: tuple[SurfaceMap, ...]


@dataclass(frozen=True, eq=False)
class Guidance:
    """All that is asked for, of one sample or several.

    Attributes
    ----------
    guides, zones
        See there; None: there is one sample.
    again
        Regions that are laid once more, one after another, and their seeds.
    model
        The file of the model that is covered: maps may name what it has.
    """

    guides: tuple[GuidePair, ...] = ()
    zones: ZoneMaps | None = None
    again: tuple[tuple[SurfaceMap, int], ...] = ()
    model: ModelFile | None = None


@stage
def guides_on(pairs: Sequence[GuidePair], ground: MapGround) -> tuple[Guide, ...]:
    """Return guides on charts.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; for a label that the sample lacks.
    """
    return tuple(_labels(pair, ground) if pair.is_label else _values(pair, ground) for pair in pairs)


def _values(pair: GuidePair, ground: MapGround) -> Guide:
    wanted = tuple(as_guide(values) for values in pair.wanted.values(ground))
    return Guide(as_guide(np.asarray(pair.shown, np.float32)), wanted, pair.weight)


def _labels(pair: GuidePair, ground: MapGround) -> Guide:
    known, shown = np.unique(pair.shown, return_inverse=True)
    if len(known) > _MOST_LABELS:
        raise InputError(
            f"labels {pair.text!r}: the sample's map has {len(known):,} colours; "
            f"allowed: up to {_MOST_LABELS}, in a PNG without smooth edges"
        )
    wanted = []
    for codes in pair.wanted.codes(ground):
        at = np.clip(np.searchsorted(known, codes), 0, len(known) - 1)
        missing = (known[at] != codes) & (codes >= 0)
        if missing.any():
            raise InputError(
                f"labels {pair.text!r}: the surface's map asks for {_colour(int(codes[missing][0]))}, which "
                f"the sample's lacks; allowed: {', '.join(map(_colour, known[:_LISTED].tolist()))}"
                + (" …" if len(known) > _LISTED else "")
            )
        wanted.append(np.where(codes < 0, 0, at + 1).astype(np.uint8))
    numbers = (shown.reshape(pair.shown.shape) + 1).astype(np.uint8)
    return Guide(numbers, tuple(wanted), pair.weight, is_label=True)


def _colour(code: int) -> str:
    return f"#{code:06x}"


@stage
def region_again(wanted: SurfaceMap, ground: MapGround, seed: int) -> Again:
    """Return a region that is laid once more.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; if nothing of the surface lies in it.
    """
    own = [_spread(one.view(np.uint8), _BLENDED, np.minimum) > 0 for one in region(wanted, ground)]
    if not any(one.any() for one in own):
        raise InputError(f"region {wanted.text!r} has nothing of the surface; allowed: one that has some")
    return Again(tuple(~one for one in own), seed)


@stage
def zones_on(maps: ZoneMaps, ground: MapGround, block: float) -> tuple[NDArray[np.uint8], ...]:
    """Return which zone each step of the charts shall show, as of `Zones`; blocks are so many steps wide.

    Raises
    ------
    InputError
        As `SurfaceMap.values`.
    """
    out = [np.ones((chart.height, chart.width), np.uint8) for chart in ground.charted.charts]
    for zone, wanted in enumerate(maps.wanted, 2):
        for own, values in zip(out, wanted.values(ground), strict=True):
            own[values > 0.5] = zone
    radius = int(block / _BAND)
    return tuple(_opened(own, radius) for own in out)


def _opened(zones: NDArray[np.uint8], radius: int) -> NDArray[np.uint8]:
    # With `EITHER` at steps that lie so near to one of another zone, by rows and by columns.
    low, high = _spread(zones, radius, np.minimum), _spread(zones, radius, np.maximum)
    return np.where(low == high, zones, zones + EITHER).astype(np.uint8)


def _spread(values: NDArray[np.uint8], radius: int, of: np.ufunc) -> NDArray[np.uint8]:
    # The least or the greatest value of the square of so many places round each, by windows of doubled
    # length.
    size, found = 2 * radius + 1, np.pad(values, radius, mode="edge")
    for axis in (0, 1):
        length = 1
        while length < size:
            step = min(length, size - length)
            first = [slice(None), slice(None)]
            second = [slice(None), slice(None)]
            first[axis], second[axis] = slice(0, found.shape[axis] - step), slice(step, None)
            found = of(found[tuple(first)], found[tuple(second)])
            length += step
    return np.asarray(found, np.uint8)
