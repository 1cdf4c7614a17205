"""Measures of covered meshes: whether seams show, size and direction of texels and of the texture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts.creases import CREASE
from upholster.charts.mesh_layout import chart_places, texels_on_mesh
from upholster.geometry import MeshSurface, TriangleMesh
from upholster.measure.edges import looked_up
from upholster.measure.samples import SEED, Window, coded
from upholster.measure.seams import MeanDifference
from upholster.measure.trace import Trace
from upholster.quilt import Chart, Quilt, Texels
from upholster.types import FloatArray, PixelArray

__all__ = [
    "MeshSeams",
    "SeamPairs",
    "SurfaceSamples",
    "mesh_samples",
    "mesh_seams",
    "smooth_texels",
    "triangle_steps",
]

MOST_PAIRS = 2**17
MOST_SAMPLES = 2**17

BESIDE = 4
"""Texels from an edge at which cuts that follow it may lie: blocks end there in cells."""

Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceSamples:
    """Random places of a mesh, evenly spread over its area.

    Attributes
    ----------
    triangle
        (n,) where they are.
    chart, rows, columns
        (n,) the texel nearest to each, on its chart.
    shares
        (n, 3) its barycentric coordinates in the triangle.
    """

    triangle: Index
    chart: Index
    rows: Index
    columns: Index
    shares: FloatArray


def triangle_steps(surface: MeshSurface, charts: tuple[Chart, ...]) -> FloatArray:
    """Return (T, 3, 2): a step of a texel down, and one to the right, in space; 0 where there is no area."""
    corners, places = surface.mesh.corners, chart_places(surface, charts)
    edges, steps = corners[:, 1:] - corners[:, :1], places[:, 1:] - places[:, :1]
    area = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 0, 1] * steps[:, 1, 0]
    sound = (area > 0) & (surface.island >= 0)
    inverse = np.stack([steps[:, 1, 1], -steps[:, 1, 0], -steps[:, 0, 1], steps[:, 0, 0]], axis=1)
    inverse = inverse.reshape(-1, 2, 2) / np.where(sound, area, 1.0)[:, None, None]
    out: FloatArray = np.where(sound[:, None, None], np.einsum("tex,tef->txf", edges, inverse), 0.0)
    return out


def mesh_samples(surface: MeshSurface, charts: tuple[Chart, ...]) -> SurfaceSamples:
    """Choose random places of a mesh, as many on any two parts of equal area."""
    rng = np.random.default_rng(SEED)
    weights = np.where(surface.island >= 0, surface.mesh.areas, 0.0)
    triangle = rng.choice(len(weights), MOST_SAMPLES, p=weights / weights.sum())
    share = np.sort(rng.random((MOST_SAMPLES, 2)), axis=1)
    share = np.stack([share[:, 0], share[:, 1] - share[:, 0], 1 - share[:, 1]], axis=1)
    place = (chart_places(surface, charts)[triangle] * share[:, :, None]).sum(axis=1)
    chart = surface.island[triangle].astype(np.intp)
    sizes = np.array([(chart.height, chart.width) for chart in charts])[chart]
    texel = np.clip(np.floor(place), 0, sizes - 1).astype(np.intp)
    return SurfaceSamples(triangle.astype(np.intp), chart, texel[:, 0], texel[:, 1], share)


def smooth_texels(
    surface: MeshSurface, charts: tuple[Chart, ...], window: Window, crease: float
) -> NDArray[np.bool_]:
    """Return which texels of a window (rows, columns) show a part of the mesh that goes on round them.

    These lie on its triangles, and not beside creases within islands, edges at which it turns by `crease`
    degrees or more.
    """
    low, shape = np.array([window.row, window.column]), (window.height, window.width)
    shown = texels_on_mesh(surface, charts, window.index, (window.row, window.column), shape)
    mesh = surface.mesh
    inner = (mesh.neighbours >= 0) & ~surface.is_seam & (surface.island == window.index)[:, None]
    triangle, edge = np.nonzero(inner)
    cosine = _cosines(mesh, triangle, edge, False)
    sharp = cosine <= np.cos(np.radians(crease))
    triangle, edge = triangle[sharp], edge[sharp]
    if not len(triangle):
        return shown
    places = chart_places(surface, charts) - low
    first, last = places[triangle, edge], places[triangle, (edge + 1) % 3]
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


@dataclass(frozen=True, slots=True)
class MeshSeams:
    """Whether seams between charts of a mesh show, against what the exemplar has at the same places.

    Attributes
    ----------
    ratio
        Across seams over which the texture goes on: 1.0 is as smooth as the exemplar, more shows, less is
        blur; None where there are none.
    creases
        Share of the seams' length where the texture starts anew, as `ratio` leaves it out.
    over_creases
        The same ratio there; None where there are none.
    """

    ratio: float | None
    creases: float
    over_creases: float | None


def mesh_seams(
    surface: MeshSurface,
    quilt: Quilt,
    texels: Texels,
    exemplar: PixelArray,
    *,
    crease: float = CREASE,
    least: float = 0.0,
    by_normals: bool = False,
) -> MeshSeams:
    """Measure whether seams between charts of a mesh show.

    As `upholster.measure.matched_edge_ratio`: the mean absolute difference between a texel beside a seam and
    the one right beyond it, over the mean of the two differences that the exemplar has over the same step. At
    most 2^17 pairs are looked at.

    Over sharp edges the texture starts anew: such a seam is what was asked for, and no figure for how well a
    texture goes on. These are left out, and looked at by themselves.

    Parameters
    ----------
    surface, quilt, texels, exemplar
        What was covered, how, the same painted, and the exemplar (H, W, C).
    crease
        Degrees: edges at which the surface turns by as much or more are such.
    least
        Degrees: edges at which it turns by less are not looked at.
    by_normals
        Whether the mesh's own normals tell how much it turns, as those of a CAD model do: its facets turn
        where the surface is smooth.
    """
    pairs = SeamPairs.of(surface, quilt.charts, least, crease, by_normals)
    if pairs is None:
        return MeshSeams(None, 0.0, None)
    seen, expected = [MeanDifference(), MeanDifference()], [MeanDifference(), MeanDifference()]
    traces = {
        chart: Trace.of(quilt, Window(chart, 0, 0, *_size(quilt.charts[chart])), beyond=True)
        for chart in np.unique(pairs.chart).tolist()
    }
    for a, b in np.unique(pairs.chart, axis=0).tolist():
        for sharp in (0, 1):
            own = np.flatnonzero((pairs.chart == (a, b)).all(axis=1) & (pairs.is_sharp == sharp))
            (rows, columns), (other_rows, other_columns) = pairs.texel[own].transpose(1, 2, 0)
            here = looked_up(traces[a], rows, columns, pairs.step[own, 0], [exemplar])
            there = looked_up(traces[b], other_rows, other_columns, pairs.step[own, 1], [exemplar])
            seen[sharp].add(
                coded(texels.arrays[a][rows, columns]),
                coded(texels.arrays[b][other_rows, other_columns]),
            )
            expected[sharp].add(*here)
            expected[sharp].add(*there)
    smooth, sharp_ratio = (one.over(other) for one, other in zip(seen, expected, strict=True))
    return MeshSeams(smooth, float(pairs.is_sharp.mean()), sharp_ratio)


def _size(chart: Chart) -> tuple[int, int]:
    return chart.height, chart.width


@dataclass(frozen=True, eq=False, slots=True)
class SeamPairs:
    """Texels beside seams of a mesh, evenly spread over their length on the charts.

    Attributes
    ----------
    chart
        (n, 2) the charts on both sides.
    texel
        (n, 2, 2) row and column of the texel beside the seam, on either.
    step
        (n, 2, 2) from one texel to the other, in texels of the one's chart, either way.
    is_sharp
        (n,) whether over a crease.
    """

    chart: Index
    texel: Index
    step: FloatArray
    is_sharp: NDArray[np.bool_]

    @classmethod
    def of(
        cls, surface: MeshSurface, charts: tuple[Chart, ...], least: float, crease: float, by_normals: bool
    ) -> "SeamPairs | None":
        """Choose at most `MOST_PAIRS` over edges that turn by `least` degrees; None without seams."""
        mesh = surface.mesh
        triangle, edge = np.nonzero(surface.is_seam)
        once = triangle < mesh.neighbours[triangle, edge] // 3
        triangle, edge = triangle[once], edge[once]
        cosine = _cosines(mesh, triangle, edge, by_normals)
        turned = cosine <= np.cos(np.radians(least))
        triangle, edge, cosine = triangle[turned], edge[turned], cosine[turned]
        other, met = mesh.neighbours[triangle, edge] // 3, mesh.neighbours[triangle, edge] % 3
        if not len(triangle):
            return None
        places, steps = chart_places(surface, charts), triangle_steps(surface, charts)
        ends = [places[triangle, edge], places[triangle, (edge + 1) % 3]]
        others = [places[other, (met + 1) % 3], places[other, met]]
        length = np.linalg.norm(ends[1] - ends[0], axis=1)
        rng = np.random.default_rng(SEED)
        at = rng.choice(len(length), min(MOST_PAIRS, 8 * int(length.sum()) + 64), p=length / length.sum())
        share = rng.random((len(at), 1))
        a = ends[0][at] * (1 - share) + ends[1][at] * share
        b = others[0][at] * (1 - share) + others[1][at] * share
        # Both planes unfolded about the edge: its tangent, and what is inward on either side.
        tangent = mesh.corners[triangle, (edge + 1) % 3] - mesh.corners[triangle, edge]
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-300)
        frames = [
            np.stack([tangent, np.cross(mesh.flat_normals[of], tangent)], axis=1)[at] @ steps[of][at]
            for of in (triangle, other)
        ]
        sound = np.ones(len(at), bool)
        for frame in frames:
            sound &= np.abs(np.linalg.det(frame)) > 1e-3 * np.abs(np.linalg.det(frames[0])).max()
        a, b, at = a[sound], b[sound], at[sound]
        first, second = (frame[sound] for frame in frames)
        inward = [np.linalg.inv(first)[:, :, 1], -np.linalg.inv(second)[:, :, 1]]
        inward = [v / np.linalg.norm(v, axis=1, keepdims=True) for v in inward]
        texel = [np.floor(p + 0.75 * v) for p, v in zip((a, b), inward, strict=True)]
        # From one texel's centre to the other's, through the seam's point.
        to = [(p - (t + 0.5))[:, :, None] for p, t in zip((a, b), texel, strict=True)]
        across = np.linalg.solve(second, first)
        step = (to[0] - np.linalg.solve(across, to[1]))[:, :, 0]
        back = (to[1] - across @ to[0])[:, :, 0]
        chart = np.stack([surface.island[triangle][at], surface.island[other][at]], axis=1).astype(np.intp)
        sizes = np.array([(c.height, c.width) for c in charts])[chart]
        texels = np.clip(np.stack(texel, axis=1), 0, sizes - 1).astype(np.intp)
        is_sharp = cosine[at] <= np.cos(np.radians(crease))
        return cls(chart, texels, np.stack([step, back], axis=1), is_sharp)

    def across_smooth(self) -> "SeamPairs":
        """Return those of which the texture goes on, each texel of the first side once."""
        _, first = np.unique(
            np.concatenate([self.chart[:, :1], self.texel[:, 0]], axis=1), axis=0, return_index=True
        )
        kept = first[~self.is_sharp[first]]
        return SeamPairs(self.chart[kept], self.texel[kept], self.step[kept], self.is_sharp[kept])


def _cosines(mesh: TriangleMesh, triangle: Index, edge: Index, by_normals: bool) -> FloatArray:
    """Return the cosines of how much the surface turns over edges, (n,): where it does most."""
    other, met = mesh.neighbours[triangle, edge] // 3, mesh.neighbours[triangle, edge] % 3
    if not by_normals or mesh.normals is None:
        flat: FloatArray = (mesh.flat_normals[triangle] * mesh.flat_normals[other]).sum(axis=1)
        return flat
    own, far = mesh.normals[triangle], mesh.normals[other]
    row = np.arange(len(triangle))
    first = (own[row, edge] * far[row, (met + 1) % 3]).sum(axis=1)
    last = (own[row, (edge + 1) % 3] * far[row, met]).sum(axis=1)
    return np.asarray(np.minimum(first, last), np.float64)
