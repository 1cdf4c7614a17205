"""Maps as users write them."""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import PurePath

from upholster.base.errors import InputError
from upholster.base.lengths import Length, read_length
from upholster.charts.directions.direction import NUMBER
from upholster.charts.directions.strokes import is_stroke_file
from upholster.charts.maps.map_images import Image, VertexColors
from upholster.charts.maps.map_source import MapSource
from upholster.charts.maps.noise import Noise
from upholster.charts.maps.ray_maps import Curvature, Occlusion
from upholster.charts.maps.shapes import Ball, Facing, Height, Part, Slope
from upholster.charts.maps.stroke_map import Painted
from upholster.charts.maps.surface_map import Least, SurfaceMap
from upholster.image.files.write import IMAGE_SUFFIXES

__all__ = ["parse_map"]

ALLOWED = (
    "an image's file, colors, part:PATTERN, height, slope, facing:z (another axis, -z, or a vector x,y,z), "
    "curvature, occlusion, noise (: and a length may follow), a ball x,y,z:radius, or a .json file of "
    "strokes; 1- in front of it; >0.5 or <0.5 after it; several joined by and"
)

_AND = re.compile(r"\s+and\s+")

_COMPARED = re.compile(rf"(.+?)\s*([<>])({NUMBER})", re.DOTALL)

_BALL = re.compile(rf"({NUMBER}),({NUMBER}),({NUMBER}):(.+)")

_VECTOR = re.compile(f"{NUMBER},{NUMBER},{NUMBER}")

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

_LONGEST = 4096

_FARTHEST = 1e18
"""Largest coordinate, as for a mesh."""


def parse_map(text: str) -> SurfaceMap:
    """Parse a map from a text.

    Parameters
    ----------
    text
        One of these, at most 4096 characters; words may have capitals:

        - the name of an image, ``mask.png``: the mean of its stored colours. It covers a flat texture, each
          face of patches, or a model by its texture coordinates; where it is clear, the map has no value;
        - ``colors``: the mean of the colours of a model's vertices;
        - ``part:Leg*``: 1 on the parts of a model whose name fits;
        - ``height``: 0 at the lowest point, 1 at the highest;
        - ``slope``: 0 where it is level, 1 where it is upright;
        - ``facing:z``, ``facing:-x``, ``facing:0,1,1``: 1 where it faces that way, ½ across, 0 the other way;
        - ``curvature``, ``curvature:3cm``: 1 at edges, ½ on flat parts, 0 in hollows, within that distance;
        - ``occlusion``, ``occlusion:3cm``: 1 where it is open, 0 where it is hidden, within that distance;
        - ``noise``, ``noise:3cm``: smooth blobs of that size;
        - ``x,y,z:3cm``: 1 within that distance of a place;
        - the name of a file of strokes with values, ``strokes.json``, see `Painted`.

        Lengths are in model units, or have a unit. ``1-`` in front inverts the map. ``>0.5`` or ``<0.5`` at
        the end then compares it, so ``1-height>0.8`` is the same as ``height<0.2``. A file whose own name
        begins with ``1-`` is written ``./1-…``.

        ``height<0.25 and slope>0.5``: several of these, joined by ``and``, are the least of their values. If
        one of the pieces is no map, the whole text is one: the name of a file or a part may contain ``and``.

    Returns
    -------
    SurfaceMap
        No file has been read yet, and the map has not been evaluated.

    Raises
    ------
    InputError
        If it is none of these, or a number is not finite or out of range.
    """
    if not isinstance(text, str):
        raise InputError(f"map is a {type(text).__name__}; allowed: {ALLOWED}")
    if len(text) > _LONGEST:
        raise InputError(f"map {text[:60]!r} … has {len(text)} characters; allowed: {_LONGEST}")
    pieces = _AND.split(text.strip())
    if len(pieces) == 1:
        return _one_map(text)
    try:
        return SurfaceMap(text.strip(), Least(tuple(_one_map(piece) for piece in pieces)))
    except InputError:
        with suppress(InputError):
            return _one_map(text)
        raise


def _one_map(text: str) -> SurfaceMap:
    """Parse a map that is not joined from several."""
    rest, above, below = text.strip(), None, None
    if compared := _COMPARED.fullmatch(rest):
        rest, number = compared[1].strip(), float(compared[3])
        if not 0 <= number <= 1:
            raise InputError(f"map {text[:60]!r} compares with {compared[3].strip()}; allowed: 0 to 1")
        above, below = (number, None) if compared[2] == ">" else (None, number)
    is_inverted = rest.startswith("1-")
    rest = rest[2:].strip() if is_inverted else rest
    return SurfaceMap(text.strip(), _source(rest, text), is_inverted, above, below)


def _source(rest: str, text: str) -> MapSource:
    """Return the source in a text, after its prefix and suffix have been removed."""
    word, colon, argument = rest.partition(":")
    reader = _WORDS.get((word.strip().lower(), bool(colon)))
    if reader is not None:
        return reader(argument.strip(), text)
    suffix = PurePath(rest).suffix.lower()
    if suffix in IMAGE_SUFFIXES:
        return Image(rest)
    if is_stroke_file(rest):
        return Painted(rest)
    if ball := _BALL.fullmatch(rest):
        x, y, z = (float(ball[k]) for k in (1, 2, 3))
        if max(abs(x), abs(y), abs(z)) > _FARTHEST:
            raise InputError(f"map {text[:60]!r} has a coordinate beyond ±1e18; allowed: less")
        return Ball((x, y, z), _length(ball[4], text, "radius"))
    raise _refused(text)


def _part(argument: str, text: str) -> MapSource:
    if not argument:
        raise InputError(f"map {text[:60]!r} names no part; allowed: part: and a name or pattern")
    return Part(argument)


def _facing(argument: str, text: str) -> MapSource:
    name = argument.lower()
    sign, axis = (-1.0, name[1:].strip()) if name.startswith("-") else (1.0, name)
    if axis in _AXES:
        x, y, z = _AXES[axis]
    elif _VECTOR.fullmatch(argument):
        sign, (x, y, z) = 1.0, (float(part) for part in argument.split(","))
    else:
        raise InputError(f"map {text[:60]!r}; allowed: facing: and x, y, z, one of them after -, or x,y,z")
    if not all(map(math.isfinite, (x, y, z))) or x == y == z == 0:
        raise InputError(f"map {text[:60]!r}; allowed: a finite vector that is not zero")
    return Facing((sign * x, sign * y, sign * z))


def _length(argument: str, text: str, name: str) -> Length:
    """Return a length above 0.

    Raises
    ------
    InputError
        If the text is not such a length.
    """
    length = read_length(argument, name=f"{name} of map {text[:60]!r}")
    if not length.number > 0:
        raise InputError(f"{name} of map {text[:60]!r} is {argument[:40]}; allowed: a length above 0")
    return length


def _refused(text: str) -> InputError:
    return InputError(f"map is {text[:60]!r}; allowed: {ALLOWED}")


_WORDS: dict[tuple[str, bool], Callable[[str, str], MapSource]] = {
    ("part", True): _part,
    ("height", False): lambda *_: Height(),
    ("colors", False): lambda *_: VertexColors(),
    ("slope", False): lambda *_: Slope(),
    ("facing", True): _facing,
    ("curvature", False): lambda *_: Curvature(),
    ("curvature", True): lambda argument, text: Curvature(_length(argument, text, "reach")),
    ("noise", False): lambda *_: Noise(),
    ("noise", True): lambda argument, text: Noise(_length(argument, text, "blobs")),
    ("occlusion", False): lambda *_: Occlusion(),
    ("occlusion", True): lambda argument, text: Occlusion(_length(argument, text, "reach")),
}
"""Parsers of the argument after the colon, by the word and whether a colon follows it."""
