"""One direction for each flat face: along its longest straight edges, or continued from its neighbours."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts.directions.direction_request import DirectionRequest, level_confidence
from upholster.charts.directions.flats import FaceBorder, flat_faces, mean_planes
from upholster.charts.directions.frames import PlaneFrames, power, root
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["Held", "held_on_faces"]

_STRAIGHT = 1.0
"""Edges run one way, or at right angles to it, if they are within this many degrees of it."""

_ROUND = 0.1
"""Edges that run one way count as straight from this share of the face's border on: a disc has none."""

_ENOUGH = 0.5
"""A level direction needs edges that run along it or across; they have at least this share of the longest."""

_ALIKE = 1e-3
"""Lengths, relative, and angles that differ by less count as equal: rounding must not decide between them."""

_TURNED = 0.9
"""A request turns about on a face if its mean line there is shorter than this; at most it is 1."""

_APART = np.radians(30)
"""From this angle between a face's direction and its neighbour's on, the field jumps between them."""


@dataclass(frozen=True, eq=False)
class Held:
    """Directions of flat faces.

    Attributes
    ----------
    face
        (T,) the number of each triangle's face, −1 for none.
    z
        (T,) complex, of size 1: the direction on flat faces; 0 elsewhere.
    apart
        (T, 3) edges, marked from both sides, over which the direction jumps.
    """

    face: IntArray
    z: ComplexArray
    apart: NDArray[np.bool_]

    def asked(self, request: DirectionRequest) -> DirectionRequest:
        """Return a request that asks for these directions as well."""
        return _asked_too(request, self.face >= 0, self.z)


@dataclass(frozen=True, eq=False)
class _Planes:
    """Faces and the edges around them, in the faces' own planes: 1 is along `x` (F, 3), i along `y`.

    `x` is level where the face slopes enough, otherwise the default direction. `upright` (F,) are the upward
    components of the normals. `along` (B,) are the edges of `border` as complex numbers of size 1, `around`
    (F,) the total lengths of each face's edges.
    """

    x: FloatArray
    y: FloatArray
    upright: FloatArray
    border: FaceBorder
    along: ComplexArray
    around: FloatArray

    @classmethod
    def of(cls, mesh: TriangleMesh, frames: PlaneFrames, face: IntArray) -> "_Planes":
        """Return the planes of the faces in `face` (T,), −1 for none."""
        normals, border = mean_planes(frames, face), FaceBorder.of(mesh, face)
        x = np.cross((0.0, 0.0, 1.0), normals)
        flat = level_confidence(normals[:, 2]) == 0
        x[flat] += (0.1, 0.01, 0.0)
        x -= np.einsum("ij,ij->i", x, normals)[:, None] * normals
        x /= np.sqrt(np.einsum("ij,ij->i", x, x))[:, None]
        y = np.cross(normals, x)
        along = np.empty(len(border.face), np.complex128)
        along.real = np.einsum("ij,ij->i", border.line, x[border.face])
        along.imag = np.einsum("ij,ij->i", border.line, y[border.face])
        size = np.sqrt(along.real**2 + along.imag**2)
        along = np.where(size > 0, along / np.where(size > 0, size, 1.0), 1.0)
        around: FloatArray = np.bincount(border.face, border.length, len(normals)).astype(np.float64)
        return cls(x, y, normals[:, 2], border, along, around)

    def sum(self, shares: FloatArray | NDArray[np.bool_]) -> FloatArray:
        """Return sums over each face's edges (F,), weighted by length."""
        sums = np.bincount(self.border.face, self.border.length * shares, len(self.x))
        return sums.astype(np.float64)

    def sums(self, shares: ComplexArray) -> ComplexArray:
        """Return the same for complex numbers."""
        return self.sum(shares.real) + 1j * self.sum(shares.imag)

    def run(self, way: ComplexArray, across: bool = False) -> NDArray[np.bool_]:
        """Return which edges (B,) run along their face's `way` (F,); with `across` also at right angles."""
        turned = self.along * np.conj(way[self.border.face])
        least = np.cos(np.radians(_STRAIGHT))
        found: NDArray[np.bool_] = np.abs(turned.real) >= least
        return found | (np.abs(turned.imag) >= least) if across else found

    def on_triangles(self, frames: PlaneFrames, face: IntArray, ways: ComplexArray) -> ComplexArray:
        """Return the faces' directions (F,) on triangles, (T,), 0 on triangles of no face."""
        mine = np.maximum(face, 0)
        vectors = ways.real[:, None] * self.x + ways.imag[:, None] * self.y
        z = frames.numbers(vectors[mine])
        size = np.sqrt(z.real**2 + z.imag**2)
        here = (face >= 0) & (size > 0)
        return np.where(here, z / np.where(here, size, 1.0), 0.0)


@dataclass(frozen=True, eq=False)
class _Adjacent:
    """Directions asked for across the edges around faces, (B,): powers, carried over; `trust` 0 for none.

    The requests' confidence does not count: right next to a lid with rounded edges it is almost zero.
    """

    power: ComplexArray
    trust: FloatArray
    fold: int

    @classmethod
    def of(
        cls, mesh: TriangleMesh, frames: PlaneFrames, request: DirectionRequest, planes: _Planes
    ) -> "_Adjacent":
        """Return the directions of a request; it is 0 where the faces' own directions are not known."""
        border = planes.border
        met = mesh.neighbours[border.triangle, border.edge]
        other = met // 3
        carried = -planes.along * np.conj(frames.along[other, met % 3])
        there = request.power[other] * power(carried, request.fold)
        return cls(there, np.where((met >= 0) & (request.confidence[other] > 0), 1.0, 0.0), request.fold)

    @property
    def lines(self) -> tuple[ComplexArray, int]:
        """The same as lines: opposite directions count as one."""
        fold = max(self.fold, 2)
        return power(self.power, fold // self.fold), fold


def held_on_faces(
    mesh: TriangleMesh, frames: PlaneFrames, request: DirectionRequest, kind: str, *, straight: bool = False
) -> Held:
    """Return the directions of flat faces on which nothing else is asked for.

    The candidates are the face's longest straight edges, the directions at right angles to them, and the
    continuation of the directions asked for around it. The one with the smallest mean angle to the
    surrounding directions wins. A level direction is kept only if straight edges run along it or at right
    angles to it, as on a gable, or if no edges are straight.

    Parameters
    ----------
    mesh, frames
        The triangles.
    request
        What is asked for.
    kind
        As in `Direction`. With "smooth", only faces count whose direction is independent all around.
    straight
        Whether to ignore directions on faces on which they turn about.
    """
    face = _unasked(frames, flat_faces(mesh, frames, tops=kind == "level"), request, kind, straight)
    if not (face >= 0).any():
        return Held(face, np.zeros(len(face), np.complex128), np.zeros(mesh.triangles.shape, np.bool_))
    planes = _Planes.of(mesh, frames, face)
    longest, length = _longest(planes)
    level = np.zeros(len(longest), np.bool_)
    if kind in ("level", "smooth"):
        borne = planes.sum(planes.run(np.ones_like(longest), across=True)) >= _ENOUGH * length
        level = (level_confidence(planes.upright) > 0) & borne
    known = planes.on_triangles(frames, face, level.astype(np.complex128))
    adjacent = _Adjacent.of(mesh, frames, _asked_too(request, face >= 0, known), planes)
    found = _signed(planes, _chosen(planes, longest, length > 0, adjacent), adjacent)
    z = planes.on_triangles(frames, face, np.where(level, 1.0 + 0j, found))
    held = Held(face, z, np.zeros(mesh.triangles.shape, np.bool_))
    return replace(held, apart=_apart(mesh, frames, planes, held, request))


def _asked_too(request: DirectionRequest, mine: NDArray[np.bool_], z: ComplexArray) -> DirectionRequest:
    """Return a request with directions z (T,) on some triangles `mine` (T,), with none where they are 0."""
    return replace(
        request,
        power=np.where(mine, power(z, request.fold), request.power),
        confidence=np.where(mine, (z != 0).astype(np.float64), request.confidence),
    )


def _unasked(
    frames: PlaneFrames, face: IntArray, request: DirectionRequest, kind: str, straight: bool
) -> IntArray:
    """Return the faces (T,), −1 for none, without those on which something else is asked for."""
    inside, count = face >= 0, int(face.max(initial=-1)) + 1
    own, areas = face[inside], frames.areas[inside]
    kept = np.ones(count, np.bool_)
    if kind == "smooth":
        region = np.zeros(count, np.int64)
        region[own] = frames.part[inside]
        kept = np.bincount(frames.part, minlength=frames.parts)[region] == np.bincount(own, minlength=count)
    elif kind != "level":
        share = areas * request.confidence[inside]
        kept = np.bincount(own, share, count) <= request.least * np.bincount(own, areas, count)
        if straight:
            kept |= _turns(frames, own, inside, request)
    if request.drawn is not None:
        kept &= np.bincount(own, request.drawn[inside], count) == 0
    return np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1)[face].astype(np.int32)


def _turns(
    frames: PlaneFrames, own: IntArray, inside: NDArray[np.bool_], request: DirectionRequest
) -> NDArray[np.bool_]:
    """Return the faces (F,) on which the lines asked for differ a lot from their mean."""
    lines = frames.vectors(request.power)[inside]
    share = frames.areas[inside] * request.confidence[inside]
    pairs = ((i, j) for i in range(3) for j in range(i, 3))
    mean = {(i, j): np.bincount(own, share * lines[:, i] * lines[:, j]) for i, j in pairs}
    tensor = np.stack([np.stack([mean[min(i, j), max(i, j)] for j in range(3)], -1) for i in range(3)], -2)
    # For a single line, the tensor's squared norm equals its squared trace; for all lines of a plane, half of
    # it.
    trace = np.einsum("fii->f", tensor)
    alike = 2 * np.einsum("fij,fij->f", tensor, tensor) - trace**2
    return np.asarray(alike < _TURNED**2 * trace**2)


def _longest(planes: _Planes) -> tuple[ComplexArray, FloatArray]:
    """Return each face's direction of its longest straight edges, (F,), and their length; 0 without any.

    Edges at right angles count together. Among equally long ways, the one nearest to x is taken.
    """
    face, length = planes.border.face, planes.border.length
    angle = np.degrees(np.arctan2(planes.along.imag, planes.along.real)) % 90.0
    # A quarter turn, twice, so that a window around each edge contains all edges that run its way.
    keys = np.concatenate([200.0 * face + angle, 200.0 * face + angle + 90.0])
    order = np.argsort(keys, kind="stable")
    sums = np.concatenate([[0.0], np.cumsum(np.tile(length, 2)[order])])
    middle = 200.0 * face + np.where(angle < 45.0, angle + 90.0, angle)
    first, last = (np.searchsorted(keys[order], middle + off) for off in (-_STRAIGHT, _STRAIGHT))
    total = sums[last] - sums[first]
    near = np.maximum(np.abs(planes.along.real), np.abs(planes.along.imag))
    chosen = _first(planes, total, near)
    # For a round hole the window may contain chords as well: the longest edge decides.
    alike = planes.run(planes.along[chosen], across=True)
    way = planes.along[_first(planes, np.where(alike, length, 0.0), near)]
    along, across = (planes.sum(planes.run(one)) for one in (way, 1j * way))
    leaning = np.abs(way.imag) > np.abs(way.real)
    turned = np.where(np.abs(along - across) <= _ALIKE * (along + across), leaning, across > along)
    return np.where(turned, 1j * way, way), np.where(
        total[chosen] >= _ROUND * planes.around, total[chosen], 0.0
    )


def _first(planes: _Planes, total: FloatArray, near: FloatArray) -> NDArray[np.intp]:
    """Return each face's (F,) edge with the greatest total; among several, that with the greatest `near`."""
    face = planes.border.face
    best = np.zeros(len(planes.x))
    np.maximum.at(best, face, total)
    able = np.flatnonzero(total >= (1 - _ALIKE) * best[face])
    order = able[np.lexsort((able, -np.rint(near[able] / _ALIKE), face[able]))]
    _, first = np.unique(face[order], return_index=True)
    return order[first]


def _chosen(
    planes: _Planes, longest: ComplexArray, straight: NDArray[np.bool_], adjacent: _Adjacent
) -> ComplexArray:
    """Return the better of a face's longest edges and its neighbours' mean: smaller mean angle wins, (F,).

    The neighbours' mean counts as along these edges, or at right angles to them, if it is within 30° of that.
    """
    lines, fold = adjacent.lines
    mean = planes.sums(adjacent.trust * lines)
    size = np.sqrt(mean.real**2 + mean.imag**2)
    some = size > _ROUND * planes.around
    wall = _rooted(np.where(some, mean / np.where(some, size, 1.0), 1.0), fold)

    def off(way: ComplexArray) -> FloatArray:
        turned = lines * np.conj(power(way, fold))[planes.border.face]
        return planes.sum(adjacent.trust * np.arctan2(np.abs(turned.imag), turned.real))

    enough = _ALIKE * planes.sum(adjacent.trust)
    best = np.where(off(1j * longest) < off(longest) - enough, 1j * longest, longest)
    turned = wall * np.conj(best)
    far = np.minimum(np.abs(turned.real), np.abs(turned.imag)) > np.sin(_APART)
    best = np.where(some & far & (off(wall) < off(best) - enough), wall, best)
    return np.where(straight, best, np.where(some, wall, 1.0))


def _signed(planes: _Planes, ways: ComplexArray, adjacent: _Adjacent) -> ComplexArray:
    """Return directions (F,) with the neighbours' sense; if they have none, the sense of x, then of y."""
    like = np.where(np.abs(ways.real) > _ALIKE, ways.real, ways.imag)
    if adjacent.fold == 1:
        shares = (adjacent.power * np.conj(ways)[planes.border.face]).real
        sense = planes.sum(adjacent.trust * shares)
        like = np.where(np.abs(sense) > _ROUND * planes.sum(adjacent.trust), sense, like)
    return np.where(like < 0, -ways, ways)


def _apart(
    mesh: TriangleMesh, frames: PlaneFrames, planes: _Planes, held: Held, request: DirectionRequest
) -> NDArray[np.bool_]:
    """Return the edges (T, 3), from both sides, where a face's direction differs from its neighbour's."""
    border = planes.border
    lines, fold = _Adjacent.of(mesh, frames, held.asked(request), planes).lines
    own = power(planes.along * np.conj(frames.along[border.triangle, border.edge]), fold)
    turned = lines * np.conj(own * power(held.z[border.triangle], fold))
    met = mesh.neighbours[border.triangle, border.edge]
    heard = held.asked(request).confidence[met // 3] >= 0.5
    far = (met >= 0) & heard & (np.arctan2(np.abs(turned.imag), turned.real) > fold * _APART)
    apart = np.zeros(mesh.triangles.shape, np.bool_)
    apart[border.triangle[far], border.edge[far]] = True
    apart[met[far] // 3, met[far] % 3] = True
    return apart


def _rooted(z: ComplexArray, fold: int) -> ComplexArray:
    return root(z) if fold == 2 else root(root(z))
