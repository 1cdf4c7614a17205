"""Which way a texture shall run on a mesh: what users ask for, and what that means on each triangle."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upholster.charts._multigrid_kernels import ComplexArray
from upholster.charts.directions import NUMBER, Vectors, parse_direction
from upholster.charts.mesh_directions.frames import PlaneFrames
from upholster.errors import InputError
from upholster.geometry import TriangleMesh
from upholster.types import FloatArray

__all__ = ["MeshDirection", "Wish", "parse_mesh_direction", "prior_of", "wish_of"]

ALLOWED = "level, smooth, degrees from level, an axis x, y or z, a vector x,y,z, or around:x, y, z or x,y,z"

_FAINT, _CLEAR = 0.03, 0.3
"""Sines of the angle between a vector and the normal: from nothing asked to followed closely."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshDirection:
    """A direction on a mesh: of the sample's rows of pixels, left to right.

    Attributes
    ----------
    text
        As the user writes it: see `parse_mesh_direction`.
    kind
        ``"level"``, ``"smooth"`` or ``"vectors"``.
    angle
        Degrees by which the field is turned in the end, clockwise seen from outside.
    vectors
        Of kind "vectors": points (n, 3) to vectors (n, 3); or an array (V, 3), one for each vertex.
    """

    text: str
    kind: str
    angle: float = 0.0
    vectors: Vectors | FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Wish:
    """What is asked for on each triangle.

    Attributes
    ----------
    power
        (T,) complex: directions to the power of `fold`, of size 1 where `confidence` is above 0.
    confidence
        (T,) 0 to 1.
    fold
        1, 2 or 4: opposite directions, or those at right angles too, count as one.
    """

    power: ComplexArray
    confidence: FloatArray
    fold: int = 1


def parse_mesh_direction(wanted: str | Vectors | ArrayLike | MeshDirection) -> MeshDirection:
    """Return the direction that a text, a function of points or an array of vectors stands for.

    Parameters
    ----------
    wanted
        ``level`` (to the right, seen from outside, along lines of equal z), ``smooth`` (as few turns as the
        shape allows), a number (degrees from level, clockwise seen from outside), ``x``, ``y``, ``z`` or a
        vector ``x,y,z`` (projected on the surface), ``around:z`` (or another axis, through the origin, as a
        right-handed screw turns); a function of points (n, 3), in model units, to vectors (n, 3); or an array
        of vectors (V, 3), one for each vertex.

    Raises
    ------
    InputError
        If it is none of these, a number is not finite, or a vector is zero.
    """
    if isinstance(wanted, MeshDirection):
        return wanted
    if callable(wanted):
        return MeshDirection(getattr(wanted, "__name__", "function"), "vectors", vectors=wanted)
    if not isinstance(wanted, str):
        return _of_array(wanted)
    written = wanted.strip()
    if written in ("level", "smooth"):
        return MeshDirection(written, written)
    if re.fullmatch(NUMBER, written):
        return MeshDirection(written, "level", angle=parse_direction(written).angle)
    if written in ("x", "y", "z"):
        axis = ",".join(str(int(name == written)) for name in "xyz")
        return MeshDirection(written, "vectors", vectors=parse_direction(axis).vectors)
    try:
        found = parse_direction(written).vectors
    except InputError as error:
        if "finite" in str(error):
            raise
        found = None
    if found is None:
        raise InputError(f"direction is {written[:40]!r}; allowed on a mesh: {ALLOWED}")
    return MeshDirection(written, "vectors", vectors=found)


def _of_array(wanted: object) -> MeshDirection:
    try:
        vectors = np.asarray(wanted, np.float64)
    except (TypeError, ValueError):
        vectors = np.zeros(0)
    if vectors.shape == (3,):
        return parse_mesh_direction(",".join(repr(float(x)) for x in vectors))
    if vectors.ndim != 2 or vectors.shape[1] != 3 or not np.isfinite(vectors).all():
        raise InputError(
            f"direction is a {type(wanted).__name__}; allowed on a mesh: {ALLOWED}, a function, "
            "or finite vectors (V, 3), one for each vertex"
        )
    return MeshDirection("vectors", "vectors", vectors=vectors)


def wish_of(mesh: TriangleMesh, frames: PlaneFrames, direction: MeshDirection) -> Wish:
    """Return what a direction asks for on each triangle.

    Raises
    ------
    InputError
        If vectors are not finite, of another shape, or nowhere along the surface.
    """
    if direction.kind == "smooth":
        count = len(mesh.triangles)
        return Wish(np.zeros(count, np.complex128), np.zeros(count))
    if direction.kind == "level":
        return _projected(frames, np.cross((0.0, 0.0, 1.0), frames.normals), unit=False)
    wish = _projected(frames, _vectors_at(mesh, direction.vectors), unit=True)
    if not wish.confidence.any():
        raise InputError(
            f"direction {direction.text!r} is nowhere along the surface; allowed: one that is somewhere"
        )
    return wish


def prior_of(frames: PlaneFrames) -> ComplexArray:
    """Return what decides where nothing else does, (T,): level, and along x on what lies flat."""
    return frames.numbers(np.cross((0.0, 0.0, 1.0), frames.normals) + np.array([0.1, 0.01, 0.0]))


def _projected(frames: PlaneFrames, vectors: FloatArray, *, unit: bool) -> Wish:
    z = frames.numbers(vectors)
    length = np.sqrt(z.real**2 + z.imag**2)
    whole = np.sqrt(np.einsum("ij,ij->i", vectors, vectors)) if unit else np.ones(len(z))
    some = length > 0
    share = np.where(whole > 0, length / np.where(whole > 0, whole, 1.0), 0.0)
    step = np.clip((share - _FAINT) / (_CLEAR - _FAINT), 0, 1)
    return Wish(z / np.where(some, length, 1.0), step * step * (3 - 2 * step))


def _vectors_at(mesh: TriangleMesh, vectors: Vectors | FloatArray | None) -> FloatArray:
    """Return the vectors at the triangles' centres, checked."""
    if isinstance(vectors, np.ndarray):
        if vectors.shape != mesh.positions.shape:
            raise InputError(
                f"direction: vectors have shape {vectors.shape}; allowed: {mesh.positions.shape}"
            )
        corners: FloatArray = vectors[mesh.triangles].mean(axis=1)
        return corners
    assert vectors is not None
    centres = mesh.corners.mean(axis=1)
    try:
        found = np.asarray(vectors(centres), np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"direction: the function fails: {error}".splitlines()[0]) from None
    if found.shape != centres.shape:
        raise InputError(f"direction: the function returns shape {found.shape}; allowed: {centres.shape}")
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        place = ", ".join(f"{x:.4g}" for x in centres[bad.argmax()])
        raise InputError(f"direction is not finite at ({place}); allowed: finite vectors")
    # Their lengths do not matter, and must not overflow.
    unit: FloatArray = found / np.maximum(np.abs(found).max(), 1e-300)
    return unit
