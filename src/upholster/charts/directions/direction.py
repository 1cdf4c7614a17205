"""The texture's direction as users ask for it."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upholster.base.errors import InputError
from upholster.base.options.direction_words import FIELD_DIRECTIONS, PATCH_DIRECTIONS
from upholster.base.types import FloatArray
from upholster.charts.directions.direction_image import (
    DirectionImage,
    is_direction_image,
    read_direction_image,
)
from upholster.runtime.stages import file_stage

__all__ = ["NUMBER", "Direction", "TriangleVectors", "Vectors", "called", "parse_direction"]

Vectors = Callable[[FloatArray], ArrayLike]
"""Points (n, 3) in model units to directions (n, 3) of any length, not zero."""

ALLOWED = (
    f"{', '.join(FIELD_DIRECTIONS)}, degrees from level, x, y or z, a vector x,y,z, or around: and one of "
    f"these axes; an image's file; on patches {' and '.join(PATCH_DIRECTIONS)} as well"
)

NUMBER = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"

_VECTOR = re.compile(f"{NUMBER},{NUMBER},{NUMBER}")

_MOST_DEGREES = 36_000


@dataclass(frozen=True, eq=False)
class TriangleVectors:
    """A function of points whose values are known only at the centroids of one mesh's triangles.

    Attributes
    ----------
    centres, vectors
        (T, 3) the triangles' centroids, and the vectors asked for there.
    """

    centres: FloatArray
    vectors: FloatArray
    __name__: str

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the vectors at the triangles' centroids; for other points raises ValueError."""
        if not np.array_equal(points, self.centres):
            raise ValueError("it is for the centres of one mesh's triangles")
        return self.vectors


@dataclass(frozen=True, slots=True, eq=False)
class Direction:
    """A direction on a surface: that of the sample's rows of pixels, left to right.

    Attributes
    ----------
    text
        The text as the user writes it: see `parse_direction`.
    kind
        A word of `direction_words.DIRECTIONS`, ``"vectors"`` or ``"image"``.
    angle
        Degrees by which the finished field is turned, clockwise seen from outside.
    vectors
        For kind "vectors": a function from points (n, 3) to vectors (n, 3); or an array, (V, 3) for vertices
        or (T, 3, 3) for triangles' corners.
    weighted
        Whether `vectors` are in the triangles' planes, and their lengths, 0 to 1, are weights.
    image
        For kind "image".
    """

    text: str
    kind: str
    angle: float = 0.0
    vectors: Vectors | FloatArray | None = None
    weighted: bool = False
    image: DirectionImage | None = None

    @property
    def is_around(self) -> bool:
        """Whether it runs round an axis, as ``around:z`` does, or ``around`` on parts of a CAD model."""
        by_part = isinstance(self.vectors, TriangleVectors) and "around" in self.text
        return by_part or self.text.startswith("around:")


def _inputs(found: "Direction", *_: object, **__: object) -> list[str]:
    return [] if found.image is None else [found.image.name]


@file_stage(_inputs)
def parse_direction(wanted: str | Vectors | ArrayLike | Direction, *, patches: bool = False) -> Direction:
    """Parse a direction from a text, a function of points or an array of vectors.

    Parameters
    ----------
    wanted
        A word for all surfaces, see `direction_words.DIRECTIONS`; a number (degrees, clockwise seen from
        outside, from u on patches and from level elsewhere), ``x``, ``y``, ``z`` or a vector ``x,y,z``
        (projected on the surface), ``around:z`` (or another axis, through the origin, as a right-handed screw
        turns); a function of points (n, 3), in model units, to vectors (n, 3); or an array of vectors (V, 3),
        one for each vertex. Or an image's file, see `read_direction_image`, over the model's texture
        coordinates; over each face's parameters on patches.
    patches
        Whether the surface consists of patches: there it may also be ``u`` (along the patches' t: to the
        right along rows of texels) or ``v`` (along s).

    Raises
    ------
    InputError
        If it is none of these, a number is not finite, a vector is zero, or an image cannot be read.
    """
    if isinstance(wanted, Direction):
        if wanted.kind in PATCH_DIRECTIONS and not patches:
            raise _refused(wanted.text)
        return wanted
    if callable(wanted):
        return Direction(getattr(wanted, "__name__", "function"), "vectors", vectors=wanted)
    if not isinstance(wanted, str):
        return _of_array(wanted)
    written = wanted.strip()
    if written in FIELD_DIRECTIONS or (patches and written in PATCH_DIRECTIONS):
        return Direction(written, written)
    if is_direction_image(written):
        return Direction(written, "image", image=read_direction_image(written))
    if re.fullmatch(NUMBER, written):
        angle = float(written)
        if abs(angle) > _MOST_DEGREES:
            allowed = f"{-_MOST_DEGREES} to {_MOST_DEGREES}"
            raise InputError(f"direction is {written[:40]} degrees; allowed: {allowed}")
        return Direction(written, "u" if patches else "level", angle=angle)
    around, colon, rest = written.partition(":")
    if colon and around.strip() != "around":
        raise _refused(written)
    return Direction(written, "vectors", vectors=_of_axis(written, rest if colon else written, bool(colon)))


def _refused(written: str) -> InputError:
    return InputError(f"direction is {written[:40]!r}; allowed: {ALLOWED}")


def _of_axis(written: str, axis: str, around: bool) -> Vectors:
    """Return the vectors along an axis, or round it."""
    name = axis.strip()
    if name in ("x", "y", "z"):
        vector = np.eye(3)["xyz".index(name)]
    elif _VECTOR.fullmatch(name):
        vector = np.array([float(part) for part in name.split(",")])
    else:
        raise _refused(written)
    size = np.abs(vector).max()
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"direction is {written[:40]!r}; allowed: a finite vector that is not zero")
    vector = vector / size
    vector /= np.linalg.norm(vector)
    if around:
        return lambda points: np.cross(vector, points)
    return lambda points: np.broadcast_to(vector, points.shape)


def _of_array(wanted: object) -> Direction:
    try:
        vectors = np.asarray(wanted, np.float64)
    except (TypeError, ValueError):
        vectors = np.zeros(0)
    if vectors.shape == (3,):
        return parse_direction(",".join(repr(float(x)) for x in vectors))
    if vectors.ndim != 2 or vectors.shape[1] != 3 or not np.isfinite(vectors).all():
        raise InputError(
            f"direction is a {type(wanted).__name__}; allowed: {ALLOWED}, a function, "
            "or finite vectors (V, 3), one for each vertex"
        )
    return Direction("vectors", "vectors", vectors=vectors)


def called(vectors: Vectors, points: FloatArray) -> FloatArray:
    """Return the vectors at points (n, 3), checked.

    Raises
    ------
    InputError
        If the function fails, or returns another shape or non-finite values; the message names the place.
    """
    try:
        found = np.asarray(vectors(points), np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"direction: the function fails: {error}".splitlines()[0]) from None
    if found.shape != points.shape:
        raise InputError(f"direction: the function returns shape {found.shape}; allowed: {points.shape}")
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        place = ", ".join(f"{x:.4g}" for x in points[bad.argmax()])
        raise InputError(f"direction is not finite at ({place}); allowed: finite vectors")
    return found
