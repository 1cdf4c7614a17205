"""`direction_field`: a unit direction at each triangle and vertex of a mesh."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.charts._multigrid_kernels import ComplexArray
from upholster.charts.directions._kernels import comb, corner_fans, take_branches, vertex_vectors
from upholster.charts.directions.direction import Direction, Vectors, parse_direction
from upholster.charts.directions.field_solving import field_power, followed
from upholster.charts.directions.frames import PlaneFrames, plane_frames, power, root
from upholster.charts.directions.held import Held, held_on_faces
from upholster.charts.directions.on_coordinates import told_on_coordinates
from upholster.charts.directions.singular import (
    indices_at_vertices,
    jumps_over_edges,
    vertices_at_creases,
)
from upholster.charts.directions.strokes import Strokes, parse_strokes, with_strokes
from upholster.charts.directions.wishes import Wish, asked_of_slopes, prior_of, wish_of
from upholster.errors import InputError
from upholster.geometry import TriangleMesh
from upholster.shown import Shown, on_a_line
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, frozen_array

__all__ = ["DirectionField", "default_direction", "direction_field"]

_GROUND = 0.75
"""Mean of the normals' upright parts from which on a mesh is mostly ground: 0.5 on a ball."""

_LAND = 0.62
"""The same mean over what slopes, from which on it is open land: 0 on walls."""


@dataclass(frozen=True, eq=False)
class DirectionField(Shown):
    """Directions on a mesh: where the sample's rows of pixels run, left to right.

    Attributes
    ----------
    mesh
        The mesh.
    vectors
        (V, 3) float64, read-only: unit tangents at the vertices; zero at those of no triangle.
    face_vectors
        (T, 3) float64, read-only: unit tangents of the triangles.
    corner_vectors
        (T, 3, 3) float64, read-only: unit vectors at the triangles' corners. What is asked for there, in the
        triangle's plane, as far as something is. Else tangent to the mean plane there, one for all triangles
        round a vertex over whose common edges the field goes on. Each in the branch nearest to its
        triangle's.
    fold
        1, 2 or 4: opposite directions, or those at right angles too, count as one in the field. At least the
        texture's symmetry; more where what was asked for has no sign, or a sense that may turn about over a
        ridge: then each triangle has the vector nearest to what was asked for.
    jumps
        (T, 3) int8, read-only: by how many quarter turns `face_vectors` jump over each edge,
        counter-clockwise; 0 where they go on, at borders and at creases.
    index
        (V,) int8, read-only: how often the field turns round each vertex, in parts 1/fold of a turn.
    singular
        (K,) int32, read-only: vertices of an index other than 0 that lie at no border and no crease.
    face
        (T,) int32, read-only: the number of the flat face whose one direction a triangle has; −1 for none.
    """

    mesh: TriangleMesh
    vectors: FloatArray
    face_vectors: FloatArray
    corner_vectors: FloatArray
    fold: int
    jumps: NDArray[np.int8]
    index: NDArray[np.int8]
    singular: IntArray
    face: IntArray

    def __repr__(self) -> str:
        return on_a_line(self, {"name": self.mesh.name, "fold": self.fold, "singular": len(self.singular)})

    @property
    def places(self) -> FloatArray:
        """Positions of the singular points, (K, 3), in model units."""
        found: FloatArray = self.mesh.positions[self.singular]
        return found

    def as_faces_run(self, asked: FloatArray) -> FloatArray:
        """Return what is asked for at corners, (T, 3, 3), where faces are flat their own directions."""
        return np.where((self.face >= 0)[:, None, None], self.corner_vectors, asked)

    def seen_jumps(self, symmetry: int) -> int:
        """Return over how many edges the field jumps by a turn that a texture of a symmetry does not hide."""
        return int(np.count_nonzero(self.jumps * symmetry % 4)) // 2

    @property
    def words(self) -> str:
        """How many singular points there are, of which indices: ``"2 singular points: 2 of +1"``."""
        values, counts = np.unique(self.index[self.singular], return_counts=True)
        if not len(values):
            return "no singular points"
        kinds = ", ".join(
            f"{count} of {'+' if value > 0 else ''}{Fraction(int(value), self.fold)}"
            for value, count in zip(values[::-1], counts[::-1], strict=True)
        )
        return f"{len(self.singular)} singular point{'s' * (len(self.singular) > 1)}: {kinds}"


@stage
def default_direction(mesh: TriangleMesh) -> str:
    """Return ``level``, ``smooth`` where a mesh is mostly ground or open land, or ``curvature`` on a tube.

    On land lines of equal height wind round every top and hollow; and ground, which is flat, would follow
    each small thing that stands on it. Else what is flat has no say: a house on a lawn is level. A tube is
    closed in itself, a knot or a ring: where level lines end on it, and those round its girth nowhere do,
    it has these.
    """
    upright = np.abs(mesh.flat_normals[:, 2])
    if float((upright * mesh.areas).sum()) > _GROUND * float(mesh.areas.sum()):
        return "smooth"
    share = mesh.areas * asked_of_slopes(upright)
    if float((upright * share).sum()) >= _LAND * float(share.sum()):
        return "smooth"
    return "curvature" if _is_tube(mesh) else "level"


def _is_tube(mesh: TriangleMesh) -> bool:
    # Whether directions of curvature have no singular point, and level ones some. Only a closed mesh whose
    # Euler characteristic is 0 can have a field without one.
    corners = len(np.unique(mesh.triangles))
    if (mesh.neighbours < 0).any() or 2 * corners != len(mesh.triangles):
        return False
    return (
        len(direction_field(mesh, "curvature").singular) == 0 < len(direction_field(mesh, "level").singular)
    )


@stage
def direction_field(
    mesh: TriangleMesh,
    direction: str | Vectors | ArrayLike | Direction | None = None,
    *,
    strokes: Strokes | None = None,
    symmetry: int = 1,
    crease: float | None = None,
    lattice: bool = False,
) -> DirectionField:
    """Return a smooth field of directions over a mesh.

    Parameters
    ----------
    mesh
        The triangles. Two that use the same two vertices meet there.
    direction
        What is asked for: see `parse_direction`. Where it says nothing the field is filled smoothly.
        By default see `default_direction`; with strokes ``smooth``.
    strokes
        Directions at places: see `parse_strokes`. Near them `direction` gives way to them.
    symmetry
        1, 2 or 4: the texture looks the same after so many turns to make a whole one.
    crease
        Degrees, 0 to 180: over edges that bend more the field may start anew. None: it goes on over all.
    lattice
        The texture repeats, as bricks do: where what is asked for runs round an axis, it goes straight over
        flat faces on which it would turn about.

    Raises
    ------
    InputError
        If an option is out of range, or the direction is wrong for the mesh.
    """
    drawn = None if strokes is None else parse_strokes(strokes, size=mesh.size)
    if direction is None:
        direction = default_direction(mesh) if drawn is None else "smooth"
    wanted = parse_direction(direction)
    if symmetry not in (1, 2, 4):
        raise InputError(f"symmetry is {symmetry!r}; allowed: 1, 2 or 4")
    wanted = told_on_coordinates(mesh, wanted)
    if crease is not None and not 0 <= crease <= 180:
        raise InputError(f"crease is {crease!r} degrees; allowed: 0 to 180")
    frames = plane_frames(mesh, crease)
    wish = wish_of(mesh, frames, wanted, crease)
    if drawn is not None:
        wish = with_strokes(mesh, frames, wish, drawn)
    held = held_on_faces(mesh, frames, wish, wanted.kind, straight=lattice and wanted.is_around)
    wish = held.asked(wish)
    if held.apart.any():
        frames = frames.parted(held.apart)
    return _field(mesh, frames, wanted, wish, held, symmetry)


def _field(
    mesh: TriangleMesh,
    frames: PlaneFrames,
    wanted: Direction,
    wish: Wish,
    held: Held,
    symmetry: int,
) -> DirectionField:
    """Return the smooth field that follows a wish, and the directions that are held on flat faces."""
    # What runs to the right on either side of a ridge runs opposite ways: the field is one of lines, and each
    # triangle has the sense that was asked for.
    signed = wish.fold == 1 and bool(wish.confidence.any()) and wanted.kind != "smooth"
    fold = max(symmetry, wish.fold, 2 if signed else 1)
    prior = prior_of(frames)
    z = field_power(
        frames,
        power(wish.power, fold // wish.fold),
        wish.confidence,
        power(prior, fold),
        fold,
        mesh.size,
        wish.least,
    )
    z = _combed(frames, z, prior, fold)
    if signed:
        z = _like(z, followed(frames, wish.power, wish.confidence, mesh.size, wish.least), fold)
    on_faces = held.face >= 0
    z = np.where(on_faces, _like(held.z, z, fold), z)
    if wanted.angle:
        turn = np.radians(wanted.angle)
        z = z * complex(np.cos(turn), -np.sin(turn))
    face_vectors = frames.vectors(z)
    corners = _at_corners(mesh, frames, face_vectors, fold)
    if wish.corners is not None:
        corners = _as_asked(frames, corners, face_vectors, wish.corners, fold)
    corners[on_faces] = face_vectors[on_faces, None]
    index = indices_at_vertices(mesh, frames, z, fold)
    return DirectionField(
        mesh,
        frozen_array(_means(frames, mesh.triangles, len(mesh.positions), face_vectors, fold)[0]),
        frozen_array(face_vectors),
        frozen_array(corners),
        fold,
        frozen_array(jumps_over_edges(mesh, frames, z, fold)),
        frozen_array(index),
        frozen_array(np.flatnonzero(index * ~vertices_at_creases(mesh, frames)).astype(np.int32)),
        frozen_array(held.face),
    )


def _combed(frames: PlaneFrames, z: ComplexArray, prior: ComplexArray, fold: int) -> ComplexArray:
    """Return roots of the powers z that agree as far as possible, region by region most like the prior."""
    if fold == 1:
        return z
    for _ in range(fold // 2):
        z = root(z)
    comb(frames.edges, frames.across, frames.carried, z, fold)
    like = np.conj(z) * prior * frames.areas
    real, imaginary = (np.bincount(frames.part, part, frames.parts) for part in (like.real, like.imag))
    if fold == 2:
        choices, turns = np.stack([real, -real]), np.array([1, -1])
    else:
        choices, turns = np.stack([real, imaginary, -real, -imaginary]), np.array([1, 1j, -1, -1j])
    turned: ComplexArray = z * turns[choices.argmax(axis=0)][frames.part]
    return turned


def _like(z: ComplexArray, wanted: ComplexArray, fold: int) -> ComplexArray:
    """Return of each number the branch nearest to the one wanted, itself where that is 0."""
    best, out = (np.conj(z) * wanted).real, z
    for _ in range(fold - 1):
        z = z * (1j if fold == 4 else -1)
        like = (np.conj(z) * wanted).real
        out, best = np.where(like > best, z, out), np.maximum(like, best)
    return out


def _means(
    frames: PlaneFrames, corners: IntArray, count: int, face_vectors: FloatArray, fold: int
) -> tuple[FloatArray, FloatArray]:
    """Return mean vectors and normals, (count, 3) each, of triangles that name a number in `corners`."""
    normals = frames.mean_normals(corners, count)
    out = np.empty((count, 3))
    vertex_vectors(corners, face_vectors, frames.areas, normals, fold, out, np.empty(count, np.int32))
    return out, normals


def _at_corners(mesh: TriangleMesh, frames: PlaneFrames, face_vectors: FloatArray, fold: int) -> FloatArray:
    fan = np.empty(mesh.triangles.shape, np.int32)
    count = corner_fans(np.where(frames.across >= 0, mesh.neighbours, -1), fan)
    fan.setflags(write=False)  # as the mesh's triangles: one kernel for both
    means, normals = _means(frames, fan, count, face_vectors, fold)
    corners = means[fan]
    if fold > 1:
        for k in range(3):
            one = np.ascontiguousarray(corners[:, k])
            take_branches(face_vectors, normals[fan[:, k]], fold, one)
            corners[:, k] = one
    return corners


def _as_asked(
    frames: PlaneFrames, corners: FloatArray, face_vectors: FloatArray, asked: FloatArray, fold: int
) -> FloatArray:
    """Return vectors at corners, brought to those asked for, (T, 3, 3), as far as these are long.

    What triangles ask for, averaged at their vertices, would be off by several degrees where they are large
    for how the surface bends; and over edges that are drawn sharp neither side would have what it asks for.
    """
    confidence = np.sqrt(np.einsum("tki,tki->tk", asked, asked))[..., None]
    wanted = asked / np.maximum(confidence, 1e-12)
    for k in range(3):
        one = np.ascontiguousarray(wanted[:, k])
        take_branches(face_vectors, frames.normals, fold, one)
        wanted[:, k] = one
    mixed = corners + np.minimum(confidence, 1.0) * (wanted - corners)
    length = np.sqrt(np.einsum("tki,tki->tk", mixed, mixed))[..., None]
    out: FloatArray = np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), corners)
    return out
