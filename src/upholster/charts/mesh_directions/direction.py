"""Which way a texture shall run on a mesh, as users ask for it."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upholster.charts.directions import NUMBER, Vectors, parse_direction
from upholster.errors import InputError
from upholster.types import FloatArray

__all__ = ["MeshDirection", "TriangleVectors", "parse_mesh_direction"]

ALLOWED = (
    "level, smooth, curvature, edges, degrees from level, x, y or z, a vector x,y,z, "
    "or around: and one of these axes; on patches u and v as well"
)


@dataclass(frozen=True, eq=False)
class TriangleVectors:
    """A function of points that knows its values at the centres of one mesh's triangles alone.

    Attributes
    ----------
    centres, vectors
        (T, 3) the triangles' centres, and what is asked for there.
    """

    centres: FloatArray
    vectors: FloatArray
    __name__: str

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the vectors at the triangles' centres; other points are a ValueError."""
        if not np.array_equal(points, self.centres):
            raise ValueError("it is for the centres of one mesh's triangles")
        return self.vectors


@dataclass(frozen=True, slots=True, eq=False)
class MeshDirection:
    """A direction on a mesh: of the sample's rows of pixels, left to right.

    Attributes
    ----------
    text
        As the user writes it: see `parse_mesh_direction`.
    kind
        ``"level"``, ``"smooth"``, ``"curvature"``, ``"edges"`` or ``"vectors"``.
    angle
        Degrees by which the field is turned in the end, clockwise seen from outside.
    vectors
        Of kind "vectors": points (n, 3) to vectors (n, 3); or an array (V, 3), one for each vertex.
    """

    text: str
    kind: str
    angle: float = 0.0
    vectors: Vectors | FloatArray | None = None

    @property
    def is_around(self) -> bool:
        """Whether it runs round an axis: as ``around:z``, or ``around`` on parts of a CAD model."""
        by_part = isinstance(self.vectors, TriangleVectors) and "around" in self.text
        return by_part or self.text.startswith("around:")


def parse_mesh_direction(wanted: str | Vectors | ArrayLike | MeshDirection) -> MeshDirection:
    """Return the direction that a text, a function of points or an array of vectors stands for.

    Parameters
    ----------
    wanted
        ``level`` (to the right, seen from outside, along lines of equal z), ``smooth`` (as few turns as the
        shape allows), ``curvature`` (the way in which the surface is bent outward most), ``edges`` (along and
        across sharp edges and borders), a number (degrees from level, clockwise seen from outside), ``x``,
        ``y``, ``z`` or a vector ``x,y,z`` (projected on the surface), ``around:z`` (or another axis, through
        the origin, as a right-handed screw turns); a function of points (n, 3), in model units, to vectors
        (n, 3); or an array of vectors (V, 3), one for each vertex.

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
    if written in ("level", "smooth", "curvature", "edges"):
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
