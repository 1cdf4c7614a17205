"""Placement requests of a user, independent of charts (guides, zones, regions, pieces); moved onto charts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.directions._kernels import nearest_triangles
from upholster.charts.maps import MapGround, SurfaceMap, parse_map, region, softened
from upholster.charts.maps.map_ground import triangles_at_steps
from upholster.errors import InputError
from upholster.image.masks import Used
from upholster.methods.quilt.guides import EITHER, Again, Guide, Rectangle, as_guide
from upholster.methods.quilt.putting import PutPiece
from upholster.stages import stage
from upholster.types import IntArray

__all__ = [
    "Guidance",
    "GuidePair",
    "Put",
    "SampleMap",
    "ZoneMaps",
    "guides_on",
    "put_on",
    "region_again",
    "regions_held",
    "zones_on",
]

_FARTHEST = 0.1
"""Maximum distance of a piece's place from the surface, as a fraction of the model's size."""

_LISTED = 6
"""Maximum number of labels that an error lists."""

_MOST_LABELS = 254

_BLENDED = 3
"""Steps over which blocks are blended. A region that is laid again shrinks by this margin, and a region that
stays grows by it."""

_PIECES = 3
"""Number of pieces across the width of a frayed border."""

_LEAST_NOISE = 0.02
"""Where a zone's share is below this, the zone does not show; above 1 minus this, no other zone shows."""

_BAND = 4
"""Where zones meet, blocks of either zone may reach into the other by their side divided by this number."""


SampleMap = NDArray[np.float32] | IntArray
"""A map of the sample's pixels, (H, W): values 0…1, or labels."""


@dataclass(frozen=True, eq=False)
class GuidePair:
    """A map of the sample paired with a map of the surface.

    Attributes
    ----------
    text
        The guide as the user wrote it.
    shown
        (H, W) the map of the sample's pixels: values 0…1, or labels 0xRRGGBB.
    wanted
        The map of the surface: the requested values.
    weight
        The guide's weight; 1 is usual.
    is_label
        Whether values are labels, which are either equal or different.
    """

    text: str
    shown: SampleMap
    wanted: SurfaceMap
    weight: float = 1.0
    is_label: bool = False


@dataclass(frozen=True, eq=False)
class ZoneMaps:
    """Several samples in one image, and the part of the surface that each covers.

    Attributes
    ----------
    rectangles
        Each sample's rectangle in the image; the first sample covers all places that no map requests.
    wanted
        For each of the other samples, the map of its places. Where several maps overlap, the last one counts.
    blend
        Width in model units over which the zones' borders fray; None: borders are exactly as in the maps.
    """

    rectangles: tuple[Rectangle, ...]
    wanted: tuple[SurfaceMap, ...]
    blend: float | None = None


@dataclass(frozen=True, eq=False)
class Put:
    """A piece of the sample, and the place where the user puts it.

    Attributes
    ----------
    text
        The option as the user wrote it.
    rectangle
        The piece's rectangle in the sample.
    place
        In model units; (column, row) on a flat texture.
    size, degrees, used
        As in `PutPiece`.
    """

    text: str
    rectangle: Rectangle
    place: tuple[float, ...]
    size: float = 1.0
    degrees: float = 0.0
    used: Used | None = None


@dataclass(frozen=True, eq=False)
class Guidance:
    """All placement requests, for one sample or several.

    Attributes
    ----------
    guides, zones
        See `GuidePair` and `ZoneMaps`; no zones (None): there is one sample.
    again
        Regions that are laid again, one after another, and their seeds.
    put
        Pieces at places that the user chose.
    held
        Regions that stay as they are in another quilt.
    """

    guides: tuple[GuidePair, ...] = ()
    zones: ZoneMaps | None = None
    again: tuple[tuple[SurfaceMap, int], ...] = ()
    put: tuple[Put, ...] = ()
    held: tuple[SurfaceMap, ...] = ()


@stage
def guides_on(pairs: Sequence[GuidePair], ground: MapGround) -> tuple[Guide, ...]:
    """Return guides on charts.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; also for a label that the sample's map lacks.
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
                f"the sample's map lacks; allowed: {', '.join(map(_colour, known[:_LISTED].tolist()))}"
                + (" …" if len(known) > _LISTED else "")
            )
        wanted.append(np.where(codes < 0, 0, at + 1).astype(np.uint8))
    numbers = (shown.reshape(pair.shown.shape) + 1).astype(np.uint8)
    return Guide(numbers, tuple(wanted), pair.weight, is_label=True)


def _colour(code: int) -> str:
    return f"#{code:06x}"


@stage
def put_on(pieces: Sequence[Put], ground: MapGround) -> tuple[PutPiece, ...]:
    """Return pieces, each at the step nearest to its place.

    Raises
    ------
    InputError
        If a place is too far from the surface, or has two coordinates and the surface is not a flat texture.
    """
    return tuple(
        PutPiece(_step_at(one, ground), one.rectangle, one.size, one.degrees, one.used) for one in pieces
    )


def _step_at(put: Put, ground: MapGround) -> tuple[int, int, int]:
    # Chart, row and column of the step nearest to a place.
    charted = ground.charted
    if len(put.place) == 2 and not ground.is_flat:
        raise InputError(f"put {put.text!r} has two coordinates; allowed: three, except on flat textures")
    # In space, a flat texture's rows run towards −y. The place is the centre of its pixel.
    x, y, *z = put.place
    point = np.array([[x + 0.5, -y - 0.5, 0.0] if not z else [x, y, *z]])
    corners = np.array(charted.mesh.corners[charted.chart >= 0])
    centres = corners.mean(axis=1)
    radii = np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1)) * (1 + 1e-12)
    found, away = np.zeros(1, np.int32), np.empty(1)
    nearest_triangles(corners, centres, radii, point, found, away)
    triangle = int(np.flatnonzero(charted.chart >= 0)[found[0]])
    own = charted.mesh.corners[triangle]
    edges = np.stack([own[1] - own[0], own[2] - own[0]], axis=1)
    shares = np.clip(np.linalg.lstsq(edges, point[0] - own[0], rcond=None)[0], 0.0, 1.0)
    shares /= max(1.0, shares.sum())
    farthest = _FARTHEST * charted.mesh.size
    if away[0] > farthest:
        nearest = ",".join(f"{number:.4g}" for number in own[0] + edges @ shares)
        raise InputError(
            f"put {put.text!r} lies {away[0]:.4g} from the surface; allowed: at most {farthest:.4g}; the "
            f"nearest point of the surface is {nearest}"
        )
    places = charted.places[triangle]
    at = places[0] + shares @ (places[1:] - places[0])
    number = int(charted.chart[triangle])
    chart = charted.charts[number]
    row, column = np.clip(at.astype(np.int64), 0, (chart.height - 1, chart.width - 1)).tolist()
    return number, row, column


@stage
def region_again(wanted: SurfaceMap, ground: MapGround, seed: int) -> Again:
    """Return a region that is laid again.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; also if the region contains no part of the surface.
    """
    # Steps off the surface are outside the region, but they are not kept.
    surface = [triangles >= 0 for triangles in triangles_at_steps(ground.charted)]
    stays = tuple(
        _spread((on & ~own).view(np.uint8), _BLENDED, np.maximum) > 0
        for own, on in zip(region(wanted, ground), surface, strict=True)
    )
    if not any((on & ~held).any() for on, held in zip(surface, stays, strict=True)):
        raise InputError(f"region {wanted.text!r} contains no part of the surface; allowed: one that does")
    return Again(stays, seed)


@stage
def regions_held(wanted: Sequence[SurfaceMap], ground: MapGround) -> tuple[NDArray[np.bool_], ...]:
    """Return for each chart a mask (height, width) of the regions that stay and of steps blended with them.

    Raises
    ------
    InputError
        As `SurfaceMap.values`.
    """
    each = zip(*(region(one, ground) for one in wanted), strict=True)
    return tuple(_spread(np.logical_or.reduce(own).view(np.uint8), _BLENDED, np.maximum) > 0 for own in each)


@stage
def zones_on(maps: ZoneMaps, ground: MapGround, block: float) -> tuple[NDArray[np.uint8], ...]:
    """Return the requested zone of each step of the charts, as in `Zones`; `block` is blocks' side in steps.

    Raises
    ------
    InputError
        As `SurfaceMap.values`.
    """
    out = [np.ones((chart.height, chart.width), np.uint8) for chart in ground.charted.charts]
    # Where borders fray, a zone shows where its share exceeds a smooth noise: in pieces that become fewer
    # towards the other zone.
    noise = None if maps.blend is None else parse_map(f"noise:{maps.blend / _PIECES!r}").values(ground)
    for zone, wanted in enumerate(maps.wanted, 2):
        shares = wanted.values(ground)
        if maps.blend is not None:
            shares = softened(shares, ground, maps.blend)
        for n, (own, values) in enumerate(zip(out, shares, strict=True)):
            own[values > (0.5 if noise is None else np.clip(noise[n], _LEAST_NOISE, 1 - _LEAST_NOISE))] = zone
    radius = int(block / _BAND)
    return tuple(_opened(own, radius) for own in out)


def _opened(zones: NDArray[np.uint8], radius: int) -> NDArray[np.uint8]:
    # Adds `EITHER` to steps that have another zone within `radius` rows and columns.
    low, high = _spread(zones, radius, np.minimum), _spread(zones, radius, np.maximum)
    return np.where(low == high, zones, zones + EITHER).astype(np.uint8)


def _spread(values: NDArray[np.uint8], radius: int, of: np.ufunc) -> NDArray[np.uint8]:
    # The minimum or maximum over the square within `radius` of each place. The window's length doubles in
    # each pass.
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
