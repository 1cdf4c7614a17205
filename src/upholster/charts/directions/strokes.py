"""Directions at single places and along lines: strokes over the surface, from texts, JSON files or arrays."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from upholster.base.errors import FormatError, InputError
from upholster.base.files import read_bytes
from upholster.base.json_text import read_json
from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts.directions._kernels import carry_from, near_by, nearest_triangles
from upholster.charts.directions.direction import NUMBER
from upholster.charts.directions.direction_request import DirectionRequest
from upholster.charts.directions.frames import PlaneFrames, power
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = [
    "MOST_STROKES",
    "Strokes",
    "is_stroke_file",
    "parse_strokes",
    "read_stroke_list",
    "stroke_texts",
    "stroke_triangles",
    "with_strokes",
]

Strokes = str | Path | ArrayLike | Sequence[str | Path]
"""What `parse_strokes` takes."""

MOST_STROKES = 10_000

_APART = 0.01
"""Distance between strokes along a line over the model's size: less than the distance of one stroke's
effect."""

_HELD = 0.05
"""Distance from a stroke up to which the field follows it, as a share of the model's size."""

_FADED = 0.07
"""Distance at which a stroke's effect ends, beyond what texture blocks need to follow it."""

_AROUND = 0.16
"""Distance from a stroke within which other directions yield to it gradually."""

_FARTHEST = 0.1
"""Greatest distance of a stroke from the surface, as a share of the model's size."""

_LEAST_ALONG = 0.05
"""Least sine of the angle between a stroke and the normal at its place: below it has no direction there."""

ALLOWED = "x,y,z:dx,dy,dz, a line x,y,z/x,y,z/…, a JSON file, or numbers of shape (n, 2, 3)"

_POINT = ",".join([NUMBER] * 3)


def parse_strokes(wanted: Strokes, *, size: float) -> FloatArray:
    """Parse strokes, (S, 2, 3): a place and a direction each, in model units.

    Parameters
    ----------
    wanted
        A text ``x,y,z:dx,dy,dz``, or a line through two points or more, ``x,y,z/x,y,z/x,y,z``; the path of a
        JSON file, whose name ends with ``.json``; a list of such texts and paths; or numbers of shape
        (S, 2, 3). A file holds a list of ``{"at": [x, y, z], "along": [dx, dy, dz]}``, of ``{"line":
        [[x, y, z], …]}``, or of ``[[x, y, z], [dx, dy, dz]]``.
    size
        The model's size. A line gets a stroke every hundredth of it, or one in each shorter part.

    Raises
    ------
    InputError
        If a text, a file or a number is wrong, a direction is zero, a line has fewer than two different
        points, or there are no strokes or more than 10,000, including those along lines.
    """
    if isinstance(wanted, (str, Path)):
        wanted = [wanted]
    if isinstance(wanted, Sequence) and all(isinstance(one, (str, Path)) for one in wanted):
        texts = [(text, name) for one in wanted for text, name in _texts(str(one))]
        count, found = 0, [np.zeros((0, 2, 3))]
        for text, name in texts:
            found.append(_of_text(text, name, size, MOST_STROKES - count))
            count += len(found[-1])
        strokes = np.concatenate(found)
    else:
        strokes = _checked(wanted, "strokes")
    if not 1 <= len(strokes) <= MOST_STROKES:
        raise InputError(f"there are {len(strokes)} strokes; allowed: 1 to {MOST_STROKES}")
    return strokes


def stroke_texts(wanted: Sequence[str]) -> tuple[str, ...]:
    """Replace the names of stroke files by their contents, so that a changed file is noticed.

    Raises
    ------
    InputError
        As `parse_strokes`, for files.
    """
    return tuple(text for one in wanted for text, _ in _texts(one))


def is_stroke_file(text: str) -> bool:
    """Whether a stroke's text is the name of a file of strokes."""
    return text.strip().lower().endswith(".json")


def with_strokes(
    mesh: TriangleMesh, frames: PlaneFrames, request: DirectionRequest, strokes: FloatArray
) -> DirectionRequest:
    """Return a request that follows strokes (S, 2, 3) near their places.

    Raises
    ------
    InputError
        If a stroke is far from the surface, or at right angles to it.
    """
    drawn, distance = _carried_from_strokes(mesh, frames, strokes)
    here = drawn != 0
    # Blocks show a mean of the field over some distance, so the field follows a stroke farther than the
    # texture.
    near = np.where(here, np.clip((_FADED - distance) / (_FADED - _HELD), 0.0, 1.0), 0.0)
    kept = np.clip((distance - _FADED) / (_AROUND - _FADED), 0.0, 1.0)
    drawn_over = np.where(near > 0, power(drawn, request.fold), request.power)
    corners = np.repeat((near[:, None] * frames.vectors(drawn))[:, None], 3, axis=1)
    if request.corners is not None:
        corners = corners + kept[:, None, None] * request.corners
    return DirectionRequest(
        drawn_over, np.where(near > 0, near, kept * request.confidence), request.fold, 0.0, corners, near > 0
    )


def stroke_triangles(mesh: TriangleMesh, points: FloatArray) -> IntArray:
    """Return the triangle nearest to each stroke's place, (S,).

    Raises
    ------
    InputError
        If a stroke is far from the surface.
    """
    centres = mesh.corners.mean(axis=1)
    radii = np.sqrt(((mesh.corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1)) * (1 + 1e-12)
    seeds, away = np.zeros(len(points), np.int32), np.empty(len(points))
    nearest_triangles(mesh.corners, centres, radii, points, seeds, away)
    if away.max() > _FARTHEST * mesh.size:
        n = int(away.argmax())
        raise InputError(
            f"stroke at {_written(points[n])} lies {away[n]:.4g} from the surface; "
            f"allowed: at most {_FARTHEST * mesh.size:.4g}"
        )
    return seeds


def _carried_from_strokes(
    mesh: TriangleMesh, frames: PlaneFrames, strokes: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    # The direction of the nearest stroke (T,), of size 1, carried from its place, 0 beyond its reach; and the
    # distance to its place, as a share of the model's size, `_AROUND` where no stroke is near.
    points = np.ascontiguousarray(strokes[:, 0])
    centres, seeds = mesh.corners.mean(axis=1), stroke_triangles(mesh, points)
    along = strokes[:, 1] / np.abs(strokes[:, 1]).max(axis=1, keepdims=True)
    along = along / np.sqrt(np.einsum("ij,ij->i", along, along))[:, None]
    upright = np.abs(np.einsum("ij,ij->i", along, frames.normals[seeds]))
    if (upright > 1 - _LEAST_ALONG**2 / 2).any():
        n = int(upright.argmax())
        raise InputError(
            f"stroke at {_written(points[n])} is at right angles to the surface; allowed: along it"
        )
    which, nearness = np.empty(len(centres), np.int32), np.empty(len(centres))
    near_by(frames.across, centres, seeds, points, _AROUND * mesh.size, which, nearness)
    drawn = np.zeros(len(centres), np.complex128)
    first = np.flatnonzero(which[seeds] == np.arange(len(seeds)))  # the first of several in one triangle
    for axes, turn in ((frames.x, 1), (frames.y, 1j)):
        drawn[seeds[first]] += turn * np.einsum("ij,ij->i", along[first], axes[seeds[first]])
    drawn[seeds[first]] /= np.sqrt(drawn[seeds[first]].real ** 2 + drawn[seeds[first]].imag ** 2)
    carry_from(
        frames.across,
        frames.edges,
        frames.carried,
        frames.weights,
        seeds,
        which,
        nearness,
        1 - _FADED / _AROUND,
        drawn,
    )
    return drawn, (1 - nearness) * _AROUND


def read_stroke_list(path: str) -> list[object]:
    """Return the list in a JSON file of strokes; its entries are not checked.

    Raises
    ------
    InputError
        If it cannot be read, or is not a list.
    """
    try:
        written = read_json(read_bytes(path))
    except FormatError as error:
        raise InputError(f"strokes {path}: {error}") from None
    if not isinstance(written, list):
        raise InputError(f"strokes {path}: a {type(written).__name__}; allowed: a list")
    return written


def _texts(text: str) -> list[tuple[str, str]]:
    """Return a text, or the texts in the file that it names, each with its name for messages."""
    if not is_stroke_file(text):
        return [(text, f"stroke {text[:60]!r}")]
    path = text.strip()
    name = f"strokes {path}"
    return [(_text_of(one, name), name) for one in read_stroke_list(path)]


def _text_of(entry: object, name: str) -> str:
    """Return the text of one entry of a file."""
    if isinstance(entry, dict) and "line" in entry:
        return "/".join(",".join(map(repr, point)) for point in _points(entry["line"], name).tolist())
    pair = [entry.get("at"), entry.get("along")] if isinstance(entry, dict) else entry
    return ":".join(",".join(map(repr, part)) for part in _checked([pair], name)[0].tolist())


def _of_text(text: str, name: str, size: float, most: int) -> FloatArray:
    """Return the strokes of a text; those along a line only if there are no more than `most`."""
    mark = "/" if "/" in text else ":"
    if not re.fullmatch(f"{_POINT}(?:/{_POINT})*" if mark == "/" else f"{_POINT}:{_POINT}", text):
        raise InputError(f"stroke is {text[:60]!r}; allowed: {ALLOWED}")
    points = [[float(x) for x in part.split(",")] for part in text.split(mark)]
    return _checked([points], name) if mark == ":" else _along(_points(points, name), size, most, name)


def _points(line: object, name: str) -> FloatArray:
    """Return the points of a line, (n, 3): two or more, each different from the previous one."""
    try:
        points = np.array(line, np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 3 or not (np.abs(points) <= 1e18).all():
        raise InputError(f"{name}: a line is not finite numbers of shape (n, 3); allowed: [[x, y, z], …]")
    kept: FloatArray = points[np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))]
    if len(kept) < 2:
        raise InputError(f"{name}: a line has one place; allowed: at least two points that differ")
    return kept


def _along(points: FloatArray, size: float, most: int, name: str) -> FloatArray:
    """Return strokes along a line (n, 3), at the midpoints of its parts, short for a model of this size."""
    ways = np.diff(points, axis=0)
    counts = np.ceil(np.sqrt((ways**2).sum(axis=1)) / (_APART * size))
    if not counts.sum() <= most:
        raise InputError(
            f"{name}: a line is {counts.sum() * _APART:.4g} times as long as the model; "
            f"allowed: {MOST_STROKES} strokes in all, a hundredth apart"
        )
    part = np.repeat(np.arange(len(ways)), counts.astype(np.int64))
    first = np.cumsum(counts) - counts
    share = (np.arange(len(part)) - first[part] + 0.5) / counts[part]
    return np.stack([points[part] + share[:, None] * ways[part], ways[part]], axis=1)


def _checked(wanted: object, name: str) -> FloatArray:
    try:
        strokes = np.array(wanted, np.float64)
    except (TypeError, ValueError):
        strokes = np.zeros(0)
    if strokes.ndim != 3 or strokes.shape[1:] != (2, 3) or not (np.abs(strokes) <= 1e18).all():
        raise InputError(f"{name}: not finite numbers of shape (n, 2, 3); allowed: {ALLOWED}")
    if (strokes[:, 1] == 0).all(axis=1).any():
        raise InputError(f"{name}: a direction is zero; allowed: vectors that are not zero")
    return strokes


def _written(point: FloatArray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"
