"""Sizes by a map: how many times as large as its size the sample is at each place of a surface.

A block is laid in one size, so from one block to the next it may change by a factor at most. Larger blocks
reach farther: so factors themselves change by so much at most for a unit of length.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from upholster.charts._mesh_sampling_kernels import distances_over_edges
from upholster.charts.charted import ChartedSurface, on_longer_steps
from upholster.charts.directions import NUMBER
from upholster.charts.maps import MapGround, SurfaceMap, parse_map
from upholster.charts.subdivision import subdivided
from upholster.errors import InputError
from upholster.geometry import TriangleMesh
from upholster.stages import file_stage
from upholster.types import FloatArray, IntArray

__all__ = ["SizeField", "SizeMap", "parse_size_map", "size_field"]

LEAST, MOST = 1 / 8, 8.0
"""Factors that may be asked for."""

FOLLOWED = 0.4
"""By how much the logarithm of the size changes over a block at most: one and a half times."""

_EDGE = 0.6
"""Of a block: longest edge of a triangle on which sizes are linear, as blocks have it."""

_RANGE = 8.0
"""Triangles are as short as the smallest blocks ask for, or as blocks so many times less than the largest:
with smaller ones these would lie on too many."""

_STEPS = 12.0
"""Steps across the smallest block, about, at which the map is looked at."""

_OFF = 0.05
"""Sizes that differ by more from what the map asks for are told."""


@dataclass(frozen=True, slots=True)
class SizeMap:
    """Sizes as users ask for them.

    Attributes
    ----------
    map
        Where.
    low, high
        How many times as large the sample is where the map is 0, and where it is 1; geometric in between.
    """

    map: SurfaceMap
    low: float
    high: float

    def named(self, name: Callable[[str], str]) -> str:
        """Return its text with other names for the files in it."""
        return f"{self.map.named(name)}={self.low!r},{self.high!r}"


@dataclass(frozen=True, eq=False, slots=True)
class SizeField:
    """Sizes over a charted surface, linear on its triangles.

    Attributes
    ----------
    corners
        (T, 3, 3) positions of the triangles' corners.
    factors
        (T, 3) how many times as large the sample is there.
    smoothed
        Part of the surface on which that is not what was asked for: it would change too fast.
    """

    corners: FloatArray
    factors: FloatArray
    smoothed: float

    @property
    def least(self) -> float:
        """The smallest."""
        return float(self.factors.min())

    @property
    def most(self) -> float:
        """The largest."""
        return float(self.factors.max())

    def at(self, triangles: IntArray, points: FloatArray) -> FloatArray:
        """Return the factors at points (n, 3) in triangles (n,), or right beside them: (n,)."""
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
    """Return the sizes that a text stands for, ``TARGET=LOW,HIGH``.

    Parameters
    ----------
    text
        A map as of `upholster.charts.maps.parse_map`, and how many times as large the sample is where it is
        0 and where it is 1: ``height=0.5,2``.

    Raises
    ------
    InputError
        If it is none, or a factor is not between 1/8 and 8.
    """
    target, equals, sizes = text.rpartition("=")
    if not equals or not re.fullmatch(f"{NUMBER},{NUMBER}", sizes):
        raise InputError(f"size_map is {text[:60]!r}; allowed: TARGET=LOW,HIGH, as height=0.5,2")
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
    """Return the sizes that a surface is covered in, and the surface on triangles as small as that takes.

    Parameters
    ----------
    wanted
        What is asked for; where its map says nothing the sample has its size.
    ground
        What the map is looked at on.
    charted, vectors
        The same charts, maybe on shorter edges, and directions at the triangles' corners (T, 3, 3).
    block
        Side of a block of the sample's own size, in model units.

    Returns
    -------
    sizes
        At the corners of the second's triangles.
    charted, vectors
        As given, on shorter edges.
    parent
        (T,) the triangle as given that each is a part of.

    Raises
    ------
    InputError
        As `SurfaceMap.values`; if the map says nothing anywhere.
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
        raise InputError(f"size_map {wanted.map.text!r} says nothing anywhere; allowed: a map that does")
    asked = _at_vertices(fine.surface.mesh, _factors(wanted, at_corners))
    factors = _followed(fine.surface.mesh, asked, FOLLOWED / block)
    off = np.abs(np.log(factors / asked)) > _OFF
    triangles, areas = fine.surface.mesh.triangles, fine.surface.mesh.areas
    smoothed = float((off[triangles].mean(axis=1) * areas).sum() / areas.sum())
    corners = fine.surface.mesh.corners
    return SizeField(corners, factors[triangles], smoothed), fine.surface, fine.vectors, fine.parent


def _octaves(charted: ChartedSurface, length: float) -> int:
    """Return by how many powers of two steps are longer that are about so long."""
    steps = np.linalg.norm(charted.steps, axis=1)
    areas = charted.mesh.areas * (charted.chart >= 0)
    step = float((steps.mean(axis=1) * areas).sum() / areas.sum())
    return max(0, int(np.log2(max(length / step, 1.0))))


def _factors(wanted: SizeMap, values: FloatArray) -> FloatArray:
    """Return what is asked for where a map has values, 1 where it has none."""
    asked = wanted.low * (wanted.high / wanted.low) ** values
    return np.where(np.isnan(asked), 1.0, asked)


def _at_vertices(mesh: TriangleMesh, corners: FloatArray) -> FloatArray:
    """Return geometric means (V,) of what corners of triangles (T, 3) have at vertices; 1 without one."""
    counts = np.bincount(mesh.triangles.ravel(), minlength=len(mesh.positions))
    sums = np.bincount(mesh.triangles.ravel(), np.log(corners).ravel(), len(mesh.positions))
    return np.asarray(np.exp(sums / np.maximum(counts, 1)), np.float64)


def _followed(mesh: TriangleMesh, factors: FloatArray, rate: float) -> FloatArray:
    """Return factors at vertices (V,) that change by no more than `rate` in a unit of length.

    Of the greatest ones that lie below what is asked for and so change, and the least ones above: the means.
    """
    lengths = rate * np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=2)
    below, above = factors.copy(), -factors
    for bound in (below, above):
        distances_over_edges(mesh.triangles, lengths, bound)
    mean: FloatArray = 0.5 * (below - above)
    return mean
