"""What the user asks of places (guides, zones, regions, pieces), moved onto charts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.charts.directions._kernels import nearest_triangles
from upholster.charts.maps.map_ground import MapGround, triangles_at_steps
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.soft_borders import softened
from upholster.charts.maps.surface_map import SurfaceMap, region
from upholster.runtime.stages import stage
from upholster.synthesis.exemplar import Guidance, Guide, Put
from upholster.synthesis.quilt.puts import PutPiece
from upholster.synthesis.quilt.steering import EITHER, Steering, as_guide

__all__ = ["region_again", "steering_on", "zones_on"]

_FARTHEST = 0.1
"""Maximum distance of a piece's place from the surface, as a fraction of the model's size."""

_LISTED = 6
"""Maximum number of labels that an error lists."""

_BLENDED = 3
"""Steps over which blocks are blended. A region that is laid again shrinks by this margin, and a region that
stays grows by it."""

_PIECES = 3
"""Number of pieces across the width of a frayed border."""

_LEAST_NOISE = 0.02
"""Where a zone's share is below this, the zone does not show; above 1 minus this, no other zone shows."""

_BAND = 4
"""Where zones meet, blocks of either zone may reach into the other by their side divided by this number."""


def steering_on(ground: MapGround, guidance: Guidance, block: float) -> Steering:
    """Return the requests on charts; `block` is the side of blocks in steps.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; for a label that the sample's map lacks; for a piece's place that is too far
        from the surface, or has two coordinates where the surface is not a flat texture; for a region that
        is laid again, and contains no part of the surface.
    """
    guides = [_wanted(guide, ground) for guide in guidance.guides]
    return Steering(
        tuple(map(np.stack, zip(*guides, strict=True))),
        zones_on(guidance, ground, block) if guidance.rectangles else (),
        tuple(_put_piece(one, ground) for one in guidance.put),
        tuple((region_again(wanted, ground), seed) for wanted, seed in guidance.again),
        _regions_held(guidance.held, ground) if guidance.held else (),
    )


@stage
def _wanted(guide: Guide, ground: MapGround) -> tuple[NDArray[np.uint8], ...]:
    # For each chart (height, width), the values or numbers of labels that a guide requests.
    known = guide.labels
    if known is None:
        return tuple(map(as_guide, guide.wanted.values(ground)))
    wanted = []
    for codes in guide.wanted.codes(ground):
        at = np.clip(np.searchsorted(known, codes), 0, len(known) - 1)
        missing = (known[at] != codes) & (codes >= 0)
        if missing.any():
            raise InputError(
                f"labels {guide.text!r}: the surface's map asks for {_colour(int(codes[missing][0]))}, which "
                f"the sample's map lacks; allowed: {', '.join(map(_colour, known[:_LISTED].tolist()))}"
                + (" …" if len(known) > _LISTED else "")
            )
        wanted.append(np.where(codes < 0, 0, at + 1).astype(np.uint8))
    return tuple(wanted)


def _colour(code: int) -> str:
    return f"#{code:06x}"


@stage
def _put_piece(put: Put, ground: MapGround) -> PutPiece:
    return PutPiece(_step_at(put, ground), put.rectangle, put.size, put.degrees, put.used)


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
def region_again(wanted: SurfaceMap, ground: MapGround) -> tuple[NDArray[np.bool_], ...]:
    """Return for each chart a mask (height, width) of the steps that do not change if a region is laid again.

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
    return stays


@stage
def _regions_held(wanted: Sequence[SurfaceMap], ground: MapGround) -> tuple[NDArray[np.bool_], ...]:
    # For each chart a mask (height, width) of the regions that stay and of steps blended with them.
    each = zip(*(region(one, ground) for one in wanted), strict=True)
    return tuple(_spread(np.logical_or.reduce(own).view(np.uint8), _BLENDED, np.maximum) > 0 for own in each)


@stage
def zones_on(guidance: Guidance, ground: MapGround, block: float) -> tuple[NDArray[np.uint8], ...]:
    """Return the requested zone of each step, as in `Steering.zones`; `block` is blocks' side in steps.

    Raises
    ------
    InputError
        As `SurfaceMap.values`.
    """
    out = [np.ones((chart.height, chart.width), np.uint8) for chart in ground.charted.charts]
    # Where borders fray, a zone shows where its share exceeds a smooth noise: in pieces that become fewer
    # towards the other zone.
    blend = guidance.blend
    noise = None if blend is None else parse_map(f"noise:{blend / _PIECES!r}").values(ground)
    for zone, wanted in enumerate(guidance.zones, 2):
        shares = wanted.values(ground)
        if blend is not None:
            shares = softened(shares, ground, blend)
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
