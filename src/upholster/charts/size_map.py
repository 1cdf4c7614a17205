"""Size maps: the factor by which the sample is enlarged at each place of a surface.

A block has one size, so the size may change only by a limited factor from one block to the next. Larger
blocks extend farther, so the factors themselves may change only by a limited amount per unit of length.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts._mesh_sampling_kernels import distances_over_edges
from upholster.charts.charted_surface import ChartedSurface, on_longer_steps
from upholster.charts.directions.direction import NUMBER
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import SurfaceMap
from upholster.charts.subdivision import subdivided
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.stages import file_stage

__all__ = ["SizeField", "SizeMap", "parse_size_map", "size_field"]

LEAST, MOST = 1 / 8, 8.0
"""Factors that users may ask for."""

FOLLOWED = 0.4
"""Greatest change of the logarithm of the size across a block: a factor of 1.5."""

_EDGE = 0.6
"""Longest edge of a triangle over the side of a block: sizes are linear on triangles, as they are on
blocks."""

_RANGE = 8.0
"""Edges are as short as the smallest blocks require, but no shorter than for blocks this many times smaller
than the largest ones: otherwise the largest blocks would cover too many triangles."""

_STEPS = 12.0
"""Approximate number of steps across the smallest block at which the map is sampled."""

_OFF = 0.05
"""Sizes whose logarithm differs from the map's by more than this are reported."""


@dataclass(frozen=True, slots=True)
class SizeMap:
    """Sizes as users ask for them.

    Attributes
    ----------
    map
        The map.
    low, high
        Factors of the sample's size where the map is 0 and where it is 1; geometric in between.
    """

    map: SurfaceMap
    low: float
    high: float

    def named(self, name: Callable[[str], str]) -> str:
        """Return its text with its files renamed."""
        return f"{self.map.named(name)}={self.low!r},{self.high!r}"


@dataclass(frozen=True, eq=False, slots=True)
class SizeField:
    """Sizes over a charted surface, linear on its triangles.

    Attributes
    ----------
    corners
        (T, 3, 3) positions of the triangles' corners.
    factors
        (T, 3) factors of the sample's size there.
    smoothed
        Share of the surface where the factor is not the one asked for, which would change too fast.
    """

    corners: FloatArray
    factors: FloatArray
    smoothed: float

    @property
    def least(self) -> float:
        """The smallest factor."""
        return float(self.factors.min())

    @property
    def most(self) -> float:
        """The largest factor."""
        return float(self.factors.max())

    def at(self, triangles: IntArray, points: FloatArray) -> FloatArray:
        """Return the factors (n,) at points (n, 3) in triangles (n,), or next to them."""
        corners = self.corners[triangles]
        first, second, to = (
            corners[:, 1] - corners[:, 0],
            corners[:, 2] - corners[:, 0],
            points - corners[:, 0],
        )
        a, b, c = (first * first).sum(axis=1), (first * second).sum(axis=1), (second * second).sum(axis=1)
        p, q = (first * to).sum(axis=1), (second * to).sum(axis=1)
        area = np.maximum(a * c - b * b, 1e-300)
        shares = np.stack([p * c - q * b, q * a - p * b], axis=1) / area[:, None]
        shares = np.clip(np.concatenate([1 - shares.sum(axis=1, keepdims=True), shares], axis=1), 0.0, 1.0)
        mean: FloatArray = (shares * self.factors[triangles]).sum(axis=1) / shares.sum(axis=1)
        return mean


def parse_size_map(text: str) -> SizeMap:
    """Parse sizes from a text, ``TARGET=LOW,HIGH``.

    Parameters
    ----------
    text
        A map as for `upholster.charts.maps.map_text.parse_map`, and the factors of the sample's size where
        the map is 0 and where it is 1: ``height=0.5,2``.

    Raises
    ------
    InputError
        If the text has another form, or a factor is not between 1/8 and 8.
    """
    target, equals, sizes = text.rpartition("=")
    if not equals or not re.fullmatch(f"{NUMBER},{NUMBER}", sizes):
        raise InputError(f"size_map is {text[:60]!r}; allowed: TARGET=LOW,HIGH, such as height=0.5,2")
    low, high = (float(size) for size in sizes.split(","))
    if not (LEAST <= low <= MOST and LEAST <= high <= MOST):
        raise InputError(f"size_map asks for {low:g} and {high:g} times the size; allowed: 1/8 to 8")
    return SizeMap(parse_map(target), low, high)


def _inputs(_: object, wanted: SizeMap, *__: object, **___: object) -> tuple[str, ...]:
    return wanted.map.files


@file_stage(_inputs)
def size_field(
    wanted: SizeMap, ground: MapGround, charted: ChartedSurface, vectors: FloatArray, block: float
) -> tuple[SizeField, ChartedSurface, FloatArray, IntArray]:
    """Return the sizes on a surface, and the surface on triangles small enough for them.

    Parameters
    ----------
    wanted
        The sizes asked for. Where the map has no value, the sample keeps its size.
    ground
        The ground on which the map is evaluated.
    charted, vectors
        The same charts, possibly with shorter edges, and directions at the triangles' corners (T, 3, 3).
    block
        Side of a block of the sample's own size, in model units.

    Returns
    -------
    sizes
        The factors at the corners of the returned triangles.
    charted, vectors
        As given, on shorter edges.
    parent
        (T,) the given triangle that each one is part of.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; if the map has no value anywhere.
    """
    smallest = min(wanted.low, wanted.high, 1.0)
    coarse = on_longer_steps(ground.charted, _octaves(charted, smallest * block / _STEPS))
    values = wanted.map.values(replace(ground, charted=coarse))
    longest = _EDGE * block * max(smallest, max(wanted.low, wanted.high, 1.0) / _RANGE)
    fine = subdivided(charted, vectors, longest)
    before, after = (np.array([(one.height, one.width) for one in of.charts]) for of in (charted, coarse))
    places = fine.surface.places * (after / before)[fine.surface.chart][:, None]
    at_corners = np.full(places.shape[:2], np.nan)
    for number, value in enumerate(values):
        own = np.flatnonzero(fine.surface.chart == number)
        rows, columns = np.floor(places[own]).astype(np.int64).transpose(2, 0, 1)
        rows, columns = np.clip(rows, 0, value.shape[0] - 1), np.clip(columns, 0, value.shape[1] - 1)
        at_corners[own] = value[rows, columns]
    if np.isnan(at_corners).all():
        raise InputError(f"size_map {wanted.map.text!r} has no value anywhere; allowed: a map that has some")
    asked = _at_vertices(fine.surface.mesh, _factors(wanted, at_corners))
    factors = _followed(fine.surface.mesh, asked, FOLLOWED / block)
    off = np.abs(np.log(factors / asked)) > _OFF
    triangles, areas = fine.surface.mesh.triangles, fine.surface.mesh.areas
    smoothed = float((off[triangles].mean(axis=1) * areas).sum() / areas.sum())
    corners = fine.surface.mesh.corners
    return SizeField(corners, factors[triangles], smoothed), fine.surface, fine.vectors, fine.parent


def _octaves(charted: ChartedSurface, length: float) -> int:
    """Return the number of powers of two by which to lengthen steps to about this length."""
    steps = np.linalg.norm(charted.steps, axis=1)
    areas = charted.mesh.areas * (charted.chart >= 0)
    step = float((steps.mean(axis=1) * areas).sum() / areas.sum())
    return max(0, int(np.log2(max(length / step, 1.0))))


def _factors(wanted: SizeMap, values: FloatArray) -> FloatArray:
    """Return the factors asked for where a map has values, 1 where it has none."""
    asked = wanted.low * (wanted.high / wanted.low) ** values
    return np.where(np.isnan(asked), 1.0, asked)


def _at_vertices(mesh: TriangleMesh, corners: FloatArray) -> FloatArray:
    """Return geometric means (V,) of the values at triangles' corners (T, 3); 1 for unused vertices."""
    counts = np.bincount(mesh.triangles.ravel(), minlength=len(mesh.positions))
    sums = np.bincount(mesh.triangles.ravel(), np.log(corners).ravel(), len(mesh.positions))
    return np.asarray(np.exp(sums / np.maximum(counts, 1)), np.float64)


def _followed(mesh: TriangleMesh, factors: FloatArray, rate: float) -> FloatArray:
    """Return factors at vertices (V,) that change by no more than `rate` in a unit of length.

    They are geometric means of two such fields: the largest one below the factors asked for, and the
    smallest one above them.
    """
    lengths = rate * np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=2)
    below, above = factors.copy(), -factors
    for bound in (below, above):
        distances_over_edges(mesh.triangles, lengths, bound)
    mean: FloatArray = 0.5 * (below - above)
    return mean
