"""Places on a charted surface where measures are taken: all over it, along seams, away from creases."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.creases import CREASE, bend_cosines
from upholster.covering.measure.samples import SEED, Window

__all__ = ["SeamPlaces", "SurfaceSamples", "smooth_steps", "surface_samples"]

MOST_PAIRS = 2**17
MOST_SAMPLES = 2**17

BESIDE = 4
"""Steps from an edge within which cuts may follow it: blocks end there in cells."""

LEAST_AREA = 1e-3
"""Relative to the square of its sides: a flatter parallelogram on a chart has no usable direction."""

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceSamples:
    """Random places of a surface, evenly spread over its area.

    Attributes
    ----------
    triangle
        (n,) the triangle of each place.
    chart
        (n,) the chart.
    texel
        (n, 2) row and column of the texel that contains each place.
    shares
        (n, 3) its barycentric coordinates in the triangle.
    """

    triangle: Index
    chart: Index
    texel: Index
    shares: FloatArray


def surface_samples(charted: ChartedSurface) -> SurfaceSamples:
    """Choose random places of a surface, uniformly by area."""
    rng = np.random.default_rng(SEED)
    weights = np.where(charted.chart >= 0, charted.mesh.areas, 0.0)
    triangle = rng.choice(len(weights), MOST_SAMPLES, p=weights / weights.sum()).astype(np.intp)
    share = np.sort(rng.random((MOST_SAMPLES, 2)), axis=1)
    share = np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], axis=1)
    place = (charted.places[triangle] * share[:, :, None]).sum(axis=1)
    chart = charted.chart[triangle].astype(np.intp)
    return SurfaceSamples(triangle, chart, _texels(charted, chart, place), share)


def smooth_steps(charted: ChartedSurface, window: Window, crease: float) -> NDArray[np.bool_]:
    """Return the steps of a window (rows, columns) that show a part of the surface without a break.

    These are on its triangles, and not next to creases within charts, which are edges at which it turns by
    `crease` degrees or more.
    """
    low, shape = (window.row, window.column), (window.height, window.width)
    shown = charted.lies_on(window.index, low, shape)
    inner = (charted.across >= 0) & ~charted.is_seam & (charted.chart == window.index)[:, None]
    triangle, edge = np.nonzero(inner)
    cosine = bend_cosines(charted.mesh, triangle, edge, charted.across[triangle, edge], by_normals=False)
    sharp = cosine <= np.cos(np.radians(crease))
    triangle, edge = triangle[sharp], edge[sharp]
    if not len(triangle):
        return shown
    first, last = charted.places[triangle, edge] - low, charted.places[triangle, (edge + 1) % 3] - low
    steps = np.ceil(np.linalg.norm(last - first, axis=1)).astype(np.intp) + 1
    of = np.repeat(np.arange(len(steps)), steps)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[of]
    texel = np.floor(first[of] + share[:, None] * (last - first)[of]).astype(np.intp)
    around = np.mgrid[-BESIDE : BESIDE + 1, -BESIDE : BESIDE + 1].reshape(2, -1).T
    for step in around:
        near = texel + step
        inside = ((near >= 0) & (near < shape)).all(axis=1)
        shown[tuple(near[inside].T)] = False
    return shown


@dataclass(frozen=True, eq=False, slots=True)
class SeamPlaces:
    """Random places on seams, evenly spread over their length on the charts, each seen from both sides.

    Attributes
    ----------
    chart
        (n, 2) the charts on both sides.
    place
        (n, 2, 2) row and column on either chart; step (r, c) has its middle at (r + ½, c + ½).
    inward
        (n, 2, 2) the steps of a unit of length straight inward, on either.
    deep
        (n, 2) the length inward that is one step from the seam, on either.
    texel
        (n, 2, 2) row and column of the texel next to the seam, on either.
    step
        (n, 2, 2) from each texel to the other one, in steps of its own chart: both planes are unfolded about
        the seam.
    is_sharp
        (n,) whether the place is on a crease.
    """

    chart: Index
    place: FloatArray
    inward: FloatArray
    deep: FloatArray
    texel: Index
    step: FloatArray
    is_sharp: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        charted: ChartedSurface,
        *,
        crease: float = CREASE,
        least: float = 0.0,
        by_normals: bool = False,
    ) -> "SeamPlaces | None":
        """Choose at most `MOST_PAIRS` over edges that turn by `least` degrees; None without seams."""
        triangle, edge, other, met = charted.seams.T
        cosine = bend_cosines(charted.mesh, triangle, edge, 3 * other + met, by_normals=by_normals)
        turned = np.flatnonzero(np.minimum(cosine, 1.0) <= np.cos(np.radians(least)))
        if not len(turned):
            return None
        places = charted.places
        first = np.stack([places[triangle, edge], places[other, (met + 1) % 3]], axis=1)
        last = np.stack([places[triangle, (edge + 1) % 3], places[other, met]], axis=1)
        length = np.linalg.norm(last - first, axis=2).mean(axis=1)[turned]
        ends, count = np.cumsum(length), min(MOST_PAIRS, 8 * int(length.sum()) + 64)
        along = (np.arange(count) + np.random.default_rng(SEED).random(count)) * (ends[-1] / count)
        at = np.minimum(np.searchsorted(ends, along, side="right"), len(ends) - 1)
        share = np.clip(1 - (ends[at] - along) / length[at], 0, 1)[:, None, None]
        at = turned[at]
        frames = np.stack([charted.beside(triangle, edge), charted.beside(other, met)], axis=1)
        sound = (np.abs(np.linalg.det(frames)) > LEAST_AREA * (frames**2).sum(axis=(2, 3))).all(axis=1)[at]
        at, share = at[sound], share[sound]
        frames, place = frames[at], (1 - share) * first[at] + share * last[at]
        along, inward = np.moveaxis(np.linalg.inv(frames), 3, 0)
        deep = np.linalg.norm(along, axis=2) * np.abs(np.linalg.det(frames))
        chart = np.stack([charted.chart[triangle], charted.chart[other]], axis=1)[at].astype(np.intp)
        texel = _texels(charted, chart, place + 0.75 * deep[..., None] * inward)
        # From one texel's centre to the other's, through the seam's place.
        to = (place - (texel + 0.5))[..., None]
        onto = -np.linalg.solve(frames[:, ::-1], frames)
        step = (to - onto[:, ::-1] @ to[:, ::-1])[..., 0]
        return cls(chart, place, inward, deep, texel, step, (cosine <= np.cos(np.radians(crease)))[at])

    def chosen(self, which: NDArray[np.bool_] | Index) -> "SeamPlaces":
        """Return some of them."""
        return SeamPlaces(*(getattr(self, each.name)[which] for each in fields(self)))

    def of_texels(self) -> "SeamPlaces":
        """Return the places over which the texture continues, one for each texel of the first side."""
        texels = np.concatenate([self.chart[:, :1], self.texel[:, 0]], axis=1)
        _, first = np.unique(texels, axis=0, return_index=True)
        return self.chosen(first[~self.is_sharp[first]])


def _texels(charted: ChartedSurface, chart: Index, place: FloatArray) -> Index:
    # The texels that contain places (…, 2) of charts (…).
    sizes = np.array([(chart.height, chart.width) for chart in charted.charts])[chart]
    return np.clip(np.floor(place), 0, sizes - 1).astype(np.intp)
