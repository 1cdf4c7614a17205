"""Cutting a mesh's long edges, so that no triangle is long where a block is short."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.base.vectors import unit_vectors
from upholster.charts._subdivision_kernels import (
    PARTS,
    Pieces,
    count_parts,
    cut_triangles,
    measure_lengths,
    order_pieces,
)
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.far_vertices import blamed_on_far, place_in_words
from upholster.geometry.components import connected
from upholster.geometry.meshes.edge_pairs import edge_pairs, numbered_edges
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.parallel import check_cancelled

__all__ = ["Subdivided", "subdivided", "subdivided_in"]

_ROUNDS = 24

_SPARE, _EACH = 2**18, 8
"""A surface may have this many pieces, and so many more for each of its triangles and for each piece that its
area explains. Only triangles that are very long and thin make more."""

_NARROW = 0.25
"""Share of the longest edge allowed: triangles whose short edge is shorter are cut across, into strips.
Halving their diagonals as well would turn every two parts into three, round after round."""


@dataclass(frozen=True, eq=False, slots=True)
class Subdivided:
    """A surface with shorter edges and the same geometry as the original.

    Attributes
    ----------
    surface
        The surface.
    parent
        (T,) int32: the original triangle that each one is part of.
    vectors
        (T, 3, 3) a unit vector at each corner; a midpoint takes the mean of the ends' vectors.
    """

    surface: ChartedSurface
    parent: IntArray
    vectors: FloatArray


def subdivided(surface: ChartedSurface, vectors: FloatArray, longest: float) -> Subdivided:
    """Halve edges until none is longer than `longest`; both sides of an edge are halved alike, without gaps.

    Diagonals across narrow triangles may be 4 % longer.

    Parameters
    ----------
    surface
        The surface to subdivide; triangles on no chart are left out. Triangles that meet across edges at
        other positions, as in a tile, still do.
    vectors
        (T, 3, 3), of unit length, at its triangles' corners.
    longest
        Greatest length of an edge, in model units.

    Raises
    ------
    InputError
        If there would be far more pieces than the surface's area and triangles explain.
    """
    found = subdivided_in(surface, vectors, longest, None)
    assert found is not None  # it has an island
    return found


def subdivided_in(
    surface: ChartedSurface, vectors: FloatArray, longest: float, box: FloatArray | None
) -> Subdivided | None:
    """Subdivide the triangles in a box (2, 3), from, to; omit those whose bounding boxes do not meet it.

    The remaining triangles and their order do not depend on the box and are the same without one. Returns
    None if none remain.
    """
    kept = np.flatnonzero(surface.chart >= 0).astype(np.int32)
    positions = surface.mesh.positions.copy()
    if box is not None:
        kept = kept[_meets(positions, surface.mesh.triangles[kept], box)]
    _check_pieces(
        surface.mesh, kept, longest, np.inf if box is None else float(np.linalg.norm(box[1] - box[0]))
    )
    values = np.concatenate([surface.places[kept], vectors[kept]], axis=2)
    triangles = Pieces(surface.mesh.triangles[kept], values, kept)
    joined = _joined_vertices(surface)
    strips = Pieces(np.zeros((0, 4), np.int32), np.zeros((0, 4, values.shape[2])), kept[:0])
    for _ in range(_ROUNDS):
        check_cancelled()
        if box is not None:
            triangles = _chosen(triangles, _meets(positions, triangles.vertices, box))
            strips = _chosen(strips, _meets(positions, strips.vertices, box))
        lengths = _lengths(strips, positions)
        uneven = (lengths[:, 0] > longest) != (lengths[:, 2] > longest)
        if uneven.any():
            triangles = _joined(triangles, _halves_of(_chosen(strips, uneven), positions))
            strips, lengths = _chosen(strips, ~uneven), lengths[~uneven]
        long_strips, lengths = lengths > longest, _lengths(triangles, positions)
        long = lengths > longest
        if not (long.any() or long_strips.any()):
            break
        ends = [_ends(pieces).reshape(-1, 2) for pieces in (triangles, strips)]
        flags = np.concatenate([long.ravel(), long_strips.ravel()])
        middles, positions, joined = _halved(np.concatenate(ends), flags, positions, joined)
        split, new = _split(triangles, middles[: long.size].reshape(-1, 3), lengths, _NARROW * longest)
        if len(strips.parent):
            new = _joined(_cut_across(strips, middles[long.size :].reshape(-1, 4)), new)
        triangles, strips = split, new
    halves = _halves_of(strips, positions)
    count = len(triangles.parent) + len(halves.parent)
    if not count:
        return None
    vertices, parent = np.empty((count, 3), np.int32), np.empty(count, np.int32)
    places, fine = np.empty((count, 3, 2)), np.empty((count, 3, 3))
    firsts = np.empty(len(surface.chart) + 1, np.int64)
    order_pieces(triangles, halves, firsts, vertices, parent, places, fine)
    mesh = TriangleMesh(positions, vertices, name=surface.mesh.name)
    across = mesh.neighbours if joined is None else edge_pairs(positions, joined[vertices])
    flat = ChartedSurface(mesh, surface.chart[parent], places, surface.charts, across)
    return Subdivided(flat, parent, fine)


def _check_pieces(mesh: TriangleMesh, kept: IntArray, longest: float, reach: float) -> None:
    """Refuse to cut the triangles `kept` into far more pieces than their area and number explain.

    Of a triangle, only a part as long as `reach` is cut.
    """
    edges = np.roll(mesh.corners[kept], -1, axis=1) - mesh.corners[kept]
    length = np.sqrt(np.einsum("tki,tki->tk", edges, edges)).max(axis=1, initial=0.0)
    areas = mesh.areas[kept]
    height = 2 * areas / np.maximum(length, 1e-300)
    # Edges are halved until they are short enough.
    along, across = (
        2.0 ** np.ceil(np.log2(np.maximum(np.minimum(side, reach) / longest, 1.0)))
        for side in (length, height)
    )
    pieces = float(np.where(along > 1, along * (across + 1), 1.0).sum())
    most = _SPARE + _EACH * (len(kept) + 8 * float(areas.sum()) / longest**2)
    if pieces > most:
        worst = int((along / across).argmax())
        raise InputError(
            f"triangles are as thin as {length[worst]:.3g} by {height[worst]:.3g}, at "
            f"{place_in_words(mesh.corners[kept[worst], 0])}, and take {pieces:,.0f} pieces of "
            f"{longest:.3g}; allowed: {most:,.0f}, as with a larger sample size{blamed_on_far(mesh)}"
        )


def _meets(positions: FloatArray, vertices: IntArray, box: FloatArray) -> NDArray[np.bool_]:
    # Which pieces, by their vertices (n, k), may meet a box: not those with all vertices beyond one of its
    # planes.
    below, above = positions < box[0], positions > box[1]
    met = np.ones(len(vertices), np.bool_)
    for beyond in (*below.T, *above.T):
        met &= ~beyond[vertices].all(axis=1)
    return met


def _ends(pieces: Pieces) -> IntArray:
    return np.stack([pieces.vertices, np.roll(pieces.vertices, -1, axis=1)], axis=2)


def _lengths(pieces: Pieces, positions: FloatArray) -> FloatArray:
    lengths = np.empty(pieces.vertices.shape)
    measure_lengths(pieces.vertices, positions, lengths)
    return lengths


def _chosen(pieces: Pieces, which: NDArray[np.bool_] | NDArray[np.intp]) -> Pieces:
    return Pieces(pieces.vertices[which], pieces.values[which], pieces.parent[which])


def _joined(*parts: Pieces) -> Pieces:
    return Pieces(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.parent for part in parts]),
    )


def _picked(pieces: Pieces, corners: tuple[int, ...]) -> Pieces:
    # Parts of pieces, by the numbers of their corners.
    vertices, values = pieces.vertices[:, corners], pieces.values[:, corners]
    return Pieces(np.ascontiguousarray(vertices), np.ascontiguousarray(values), pieces.parent)


def _halves_of(strips: Pieces, positions: FloatArray) -> Pieces:
    # Splits strips into two triangles each along the shorter diagonal.
    a, b, c, d = positions[strips.vertices].transpose(1, 0, 2)
    first = np.linalg.norm(c - a, axis=1) <= np.linalg.norm(d - b, axis=1)
    one, other = _chosen(strips, first), _chosen(strips, ~first)
    halves = [_picked(one, (0, 1, 2)), _picked(one, (0, 2, 3))]
    return _joined(*halves, _picked(other, (0, 1, 3)), _picked(other, (1, 2, 3)))


def _joined_vertices(surface: ChartedSurface) -> IntArray | None:
    # Numbers of vertices, (V,), equal for vertices that meet across edges at other positions; None if none
    # do.
    triangles, across = surface.mesh.triangles, surface.across
    triangle, edge = np.nonzero(across >= 0)
    other, met = np.divmod(across[triangle, edge], 3)
    pairs = np.stack([triangles[triangle, edge], triangles[other, (met + 1) % 3]], axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    if not len(pairs):
        return None
    return connected(len(surface.mesh.positions), pairs)


def _halved(
    ends: IntArray, long: NDArray[np.bool_], positions: FloatArray, joined: IntArray | None
) -> tuple[IntArray, FloatArray, IntArray | None]:
    # Adds vertices at the midpoints of long edges (E, 2). Returns their numbers (E,), −1 elsewhere, the
    # extended positions, and the extended `joined`: midpoints meet if the ends of their edges do.
    count = len(positions)
    numbers, examples = numbered_edges(np.where(long, ends[:, 0], np.int32(-1)), ends[:, 1].copy(), count)
    low, high = ends[examples].T
    middles = np.where(long, count + numbers, -1).astype(np.int32)
    if joined is not None:
        one, other = np.sort([joined[low], joined[high]], axis=0).astype(np.int64)
        _, first, met = np.unique(one * count + other, return_index=True, return_inverse=True)
        joined = np.concatenate([joined, (count + first[met.reshape(-1)]).astype(np.int32)])
    return middles, np.concatenate([positions, 0.5 * (positions[low] + positions[high])]), joined


def _with_middles(pieces: Pieces, middles: IntArray) -> Pieces:
    # Appends the midpoints of the edges to the corners.
    values = pieces.values
    between = 0.5 * (values + np.roll(values, -1, axis=1))
    # Where the vectors of two ends cancel, their midpoint takes that of one end.
    between[..., 2:] = unit_vectors(between[..., 2:], least=1e-3, instead=values[..., 2:])
    vertices = np.concatenate([pieces.vertices, middles], axis=1)
    return Pieces(vertices, np.concatenate([values, between], axis=1), pieces.parent)


def _cut_across(strips: Pieces, middles: IntArray) -> Pieces:
    # Cuts each strip whose long sides are cut into two strips.
    cut = middles[:, 0] >= 0
    whole = _with_middles(_chosen(strips, cut), middles[cut])
    halves = _joined(_picked(whole, (0, 4, 6, 3)), _picked(whole, (4, 1, 2, 6)))
    return _joined(_chosen(strips, ~cut), halves)


def _split(triangles: Pieces, middles: IntArray, lengths: FloatArray, narrow: float) -> tuple[Pieces, Pieces]:
    # Cuts triangles at the midpoints of one, two or three edges; those with a short third edge leave strips.
    counts, strip_counts = np.empty(PARTS, np.int64), np.empty(3, np.int64)
    count_parts(middles, lengths, narrow, counts, strip_counts)
    split, strips = Pieces.of(int(counts.sum()), 3), Pieces.of(int(strip_counts.sum()), 4)
    places, strip_places = np.cumsum(counts) - counts, np.cumsum(strip_counts) - strip_counts
    cut_triangles(triangles, middles, lengths, narrow, places, strip_places, split, strips, Pieces.of(1, 6))
    return split, strips
