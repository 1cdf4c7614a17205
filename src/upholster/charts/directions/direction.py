"""What a direction is: as users write it, and as a function of points."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upholster.errors import InputError
from upholster.types import FloatArray

__all__ = ["NUMBER", "Direction", "Vectors", "called", "parse_direction", "written_point"]

Vectors = Callable[[FloatArray], ArrayLike]
"""Points (n, 3) in model units to directions (n, 3) of any length, not zero."""

ALLOWED = "level, u, v, degrees from u, a vector x,y,z, or around:x, y, z or x,y,z"

NUMBER = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"


@dataclass(frozen=True, slots=True)
class Direction:
    """A direction on a surface: of the exemplar's rows of pixels, left to right.

    Attributes
    ----------
    text
        As the user writes it: see `parse_direction`.
    along
        ``"u"`` or ``"v"``: along a patch's t or s; `angle` counts from there. ``"level"``: to the right along
        lines of equal height. Empty: along `vectors`.
    angle
        Degrees, clockwise seen from outside: from +column towards +row.
    vectors
        Points to vectors in space, which are projected on the surface.
    """

    text: str
    along: str = ""
    angle: float = 0.0
    vectors: Vectors | None = None


def parse_direction(text: str | Vectors) -> Direction:
    """Return the direction that a text, or a function of points, stands for.

    Parameters
    ----------
    text
        ``level`` (to the right, seen from outside, along lines of equal z), ``u`` (along the patches' t: to
        the right along texel rows), ``v`` (along s), a number (degrees from
        u, clockwise seen from outside), ``x,y,z`` (a vector in space, projected on the surface),
        ``around:z`` (or ``x``, ``y``, or an axis ``x,y,z``: round that axis through the origin, with it as a
        right-handed screw turns); or a function of points (n, 3), in model units, to vectors (n, 3).

    Raises
    ------
    InputError
        If the text is none of these, a number is not finite, or a vector is zero.
    """
    if not isinstance(text, str):
        if not callable(text):
            raise InputError(f"direction is a {type(text).__name__}; allowed: {ALLOWED}, or a function")
        return Direction(getattr(text, "__name__", "function"), vectors=text)
    written = text.strip()
    if written in ("level", "u", "v"):
        return Direction(written, along=written)
    if re.fullmatch(NUMBER, written):
        angle = float(written)
        if abs(angle) > 36000:
            raise InputError(f"direction is {written[:40]} degrees; allowed: -36000 to 36000")
        return Direction(written, along="u", angle=angle)
    kind, colon, rest = written.partition(":")
    if colon and kind.strip() != "around":
        raise InputError(f"direction is {written[:40]!r}; allowed: {ALLOWED}")
    name = (rest if colon else kind).strip()
    if colon and name in ("x", "y", "z"):
        vector = np.eye(3)["xyz".index(name)]
    elif re.fullmatch(f"{NUMBER},{NUMBER},{NUMBER}", name):
        vector = np.array([float(part) for part in name.split(",")])
    else:
        raise InputError(f"direction is {written[:40]!r}; allowed: {ALLOWED}")
    size = np.abs(vector).max()
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"direction is {written[:40]!r}; allowed: a finite vector that is not zero")
    vector = vector / size
    vector /= np.linalg.norm(vector)
    if colon:
        return Direction(written, vectors=lambda points: np.cross(vector, points))
    return Direction(written, vectors=lambda points: np.broadcast_to(vector, points.shape))


def called(vectors: Vectors, points: FloatArray, place: Callable[[int], str] | None = None) -> FloatArray:
    """Return the vectors at points (…, 3), checked; `place` tells where the points with a first index are.

    Raises
    ------
    InputError
        If the function fails, or returns another shape or what is not finite: names the place.
    """
    flat = points.reshape(-1, 3)
    try:
        found = np.asarray(vectors(flat), np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"direction: the function fails: {error}".splitlines()[0]) from None
    if found.shape != flat.shape:
        raise InputError(f"direction: the function returns shape {found.shape}; allowed: {flat.shape}")
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        n = int(bad.argmax())
        where = "" if place is None else f"on {place(n * len(points) // len(flat))}, "
        raise InputError(
            f"direction is not finite {where}at ({written_point(flat[n])}); allowed: finite vectors"
        )
    return found.reshape(points.shape)


def written_point(point: FloatArray) -> str:
    """Return a point as messages show it."""
    return ", ".join(f"{x:.4g}" for x in point)
