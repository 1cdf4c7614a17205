"""`direction_field`: a unit direction at each triangle and vertex of a mesh."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError
from upholster.base.types import ComplexArray, FloatArray, IntArray, frozen_array
from upholster.charts.directions._kernels import comb, corner_fans, take_branches, vertex_vectors
from upholster.charts.directions.coordinate_directions import vectors_on_coordinates
from upholster.charts.directions.direction import Direction, Vectors, parse_direction
from upholster.charts.directions.direction_request import (
    DirectionRequest,
    direction_request,
    level_confidence,
    prior_of,
)
from upholster.charts.directions.field_solution import field_power, followed
from upholster.charts.directions.flat_directions import Held, held_on_faces
from upholster.charts.directions.frames import PlaneFrames, plane_frames, power, root
from upholster.charts.directions.singularities import (
    indices_at_vertices,
    jumps_over_edges,
    vertices_at_creases,
)
from upholster.charts.directions.strokes import Strokes, parse_strokes, with_strokes
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.runtime.stages import stage

__all__ = ["DirectionField", "default_direction", "direction_field"]

_GROUND = 0.75
"""A mesh is mostly ground if the mean of its normals' upward components exceeds this: 0.5 on a ball."""

_LAND = 0.62
"""A mesh is open land if the same mean over its sloping parts exceeds this: 0 on walls."""


@dataclass(frozen=True, eq=False)
class DirectionField(Shown):
    """Directions on a mesh: where the sample's rows of pixels run, left to right.

    Attributes
    ----------
    mesh
        The mesh.
    vectors
        (V, 3) float64, read-only: unit tangents at the vertices; zero at vertices of no triangle.
    face_vectors
        (T, 3) float64, read-only: unit tangents of the triangles.
    corner_vectors
        (T, 3, 3) float64, read-only: unit vectors at the triangles' corners. Where a direction is asked for,
        they are that direction in the triangle's plane. Elsewhere they are tangent to the mean plane, and
        equal for all triangles around a vertex if the field is continuous over their common edges. Each is in
        the branch nearest to its triangle's vector.
    fold
        1, 2 or 4: with 2 opposite directions count as one, with 4 also those at right angles. At least the
        texture's symmetry. Higher where the direction asked for has no sign, or where its sense may reverse
        over a ridge: then each triangle has the vector nearest to the one asked for.
    jumps
        (T, 3) int8, read-only: quarter turns, counter-clockwise, by which `face_vectors` jump over each edge;
        0 where they are continuous, at borders and at creases.
    index
        (V,) int8, read-only: the field's rotation around each vertex, in parts 1/fold of a turn.
    singular
        (K,) int32, read-only: vertices with a non-zero index that are on no border and no crease.
    face
        (T,) int32, read-only: the number of the flat face that sets a triangle's direction; −1 for none.
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

    def with_flat_faces(self, asked: FloatArray) -> FloatArray:
        """Return directions asked for at corners, (T, 3, 3), but flat faces' own directions on these."""
        return np.where((self.face >= 0)[:, None, None], self.corner_vectors, asked)

    @property
    def words(self) -> str:
        """The number of singular points and their indices, as in ``"2 singular points: 2 of +1"``."""
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
    """Return a mesh's default: ``level``, ``smooth`` on ground and open land, or ``curvature`` on a tube.

    On land, lines of equal height wind around every hill and hollow, and the flat ground would follow every
    small thing on it. Otherwise flat parts have no influence: a house on a lawn gets level directions. A tube
    is closed, like a knot or a ring. It gets directions of curvature if level lines have ends on it and lines
    around its girth have none.
    """
    upright = np.abs(mesh.flat_normals[:, 2])
    if float((upright * mesh.areas).sum()) > _GROUND * float(mesh.areas.sum()):
        return "smooth"
    share = mesh.areas * level_confidence(upright)
    if float((upright * share).sum()) >= _LAND * float(share.sum()):
        return "smooth"
    return "curvature" if _is_tube(mesh) else "level"


def _is_tube(mesh: TriangleMesh) -> bool:
    # Whether directions of curvature have no singular point and level ones have some. Only a closed mesh with
    # Euler characteristic 0 can have a field without singular points.
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
        The triangles. Two that share two vertices are adjacent.
    direction
        The direction asked for: see `parse_direction`. The field is filled smoothly elsewhere. See
        `default_direction` for the default; with strokes it is ``smooth``.
    strokes
        Directions at places: see `parse_strokes`. Near them they override `direction`.
    symmetry
        1, 2 or 4: the texture looks the same after a full turn divided by this.
    crease
        Degrees, 0 to 180: the field may jump over edges that bend more. None: it is continuous over all
        edges.
    lattice
        Whether the texture repeats, as bricks do: then directions around an axis run straight over flat faces
        on which they would otherwise turn.

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
    wanted = vectors_on_coordinates(mesh, wanted)
    if crease is not None and not 0 <= crease <= 180:
        raise InputError(f"crease is {crease!r} degrees; allowed: 0 to 180")
    frames = plane_frames(mesh, crease)
    request = direction_request(mesh, frames, wanted, crease)
    if drawn is not None:
        request = with_strokes(mesh, frames, request, drawn)
    held = held_on_faces(mesh, frames, request, wanted.kind, straight=lattice and wanted.is_around)
    request = held.asked(request)
    if held.apart.any():
        frames = frames.parted(held.apart)
    return _field(mesh, frames, wanted, request, held, symmetry)


def _field(
    mesh: TriangleMesh,
    frames: PlaneFrames,
    wanted: Direction,
    request: DirectionRequest,
    held: Held,
    symmetry: int,
) -> DirectionField:
    """Return the smooth field that follows a request, and the directions that flat faces hold."""
    # "To the right" means opposite ways on the two sides of a ridge. So the field consists of lines, and each
    # triangle takes the sense that was asked for.
    signed = request.fold == 1 and bool(request.confidence.any()) and wanted.kind != "smooth"
    fold = max(symmetry, request.fold, 2 if signed else 1)
    prior = prior_of(frames)
    z = field_power(
        frames,
        power(request.power, fold // request.fold),
        request.confidence,
        power(prior, fold),
        fold,
        mesh.size,
        request.least,
    )
    z = _combed(frames, z, prior, fold)
    if signed:
        z = _like(z, followed(frames, request.power, request.confidence, mesh.size, request.least), fold)
    on_faces = held.face >= 0
    z = np.where(on_faces, _like(held.z, z, fold), z)
    if wanted.angle:
        turn = np.radians(wanted.angle)
        z = z * complex(np.cos(turn), -np.sin(turn))
    face_vectors = frames.vectors(z)
    corners = _at_corners(mesh, frames, face_vectors, fold)
    if request.corners is not None:
        corners = _as_asked(frames, corners, face_vectors, request.corners, fold)
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
    """Return roots of the powers z that agree where possible; in each region those most like the prior."""
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
    """Return each number's branch nearest to the wanted number, unchanged where that is 0."""
    best, out = (np.conj(z) * wanted).real, z
    for _ in range(fold - 1):
        z = z * (1j if fold == 4 else -1)
        like = (np.conj(z) * wanted).real
        out, best = np.where(like > best, z, out), np.maximum(like, best)
    return out


def _means(
    frames: PlaneFrames, corners: IntArray, count: int, face_vectors: FloatArray, fold: int
) -> tuple[FloatArray, FloatArray]:
    """Return mean vectors and normals, (count, 3) each, of the triangles with each number in `corners`."""
    normals = frames.mean_normals(corners, count)
    out = np.empty((count, 3))
    vertex_vectors(corners, face_vectors, frames.areas, normals, fold, out, np.empty(count, np.int32))
    return out, normals


def _at_corners(mesh: TriangleMesh, frames: PlaneFrames, face_vectors: FloatArray, fold: int) -> FloatArray:
    fan = np.empty(mesh.triangles.shape, np.int32)
    count = corner_fans(np.where(frames.across >= 0, mesh.neighbours, -1), fan)
    fan.setflags(write=False)  # like the mesh's triangles, so that one kernel serves both
    means, normals = _means(frames, fan, count, face_vectors, fold)
    corners = means[fan]
    if fold > 1:
        for k in range(3):
            one, mean = np.ascontiguousarray(corners[:, k]), normals[fan[:, k]]
            # Where two triangles with the same edges cancel, a mean normal is 0: nothing turns about it.
            mean = np.where(mean.any(axis=1, keepdims=True), mean, frames.normals)
            take_branches(face_vectors, mean, fold, one)
            corners[:, k] = one
    return corners


def _as_asked(
    frames: PlaneFrames, corners: FloatArray, face_vectors: FloatArray, asked: FloatArray, fold: int
) -> FloatArray:
    """Return vectors at corners, blended with those asked for, (T, 3, 3), by the lengths of the latter.

    Averaging the triangles' directions at vertices would be off by several degrees where triangles are large
    for the surface's curvature. And at edges drawn sharp, neither side would get the direction it asks for.
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
