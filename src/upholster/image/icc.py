"""Colour profiles made of a matrix and curves: ICC's tags, and the light that a sample stands for.

Profiles that hold tables instead are left to Little CMS, see `upholster.image.profiles`.
"""

import struct
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray

__all__ = [
    "SRGB_TO_XYZ",
    "Chromaticities",
    "Curve",
    "GammaCurve",
    "Profile",
    "TableCurve",
    "read_profile",
    "rgb_profile",
]

Chromaticities = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
"""(x, y) of red, green, blue and white."""

D50: FloatArray = np.array([0.9642, 1.0, 0.8249])
"""White of the connection space (ICC.1:2022, section 7.2.16)."""

SRGB_TO_XYZ: FloatArray = np.array(
    [
        [0.43604125, 0.38511291, 0.14304584],
        [0.22248454, 0.71690508, 0.06061038],
        [0.01392019, 0.09706724, 0.71391257],
    ]
)
"""Linear sRGB to XYZ relative to D50: the primaries of IEC 61966-2-1, adapted by Bradford's
matrix (ICC.1:2022, annex E). Rows add up to D50."""

_BRADFORD: FloatArray = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
"""From XYZ to responses of the eye's cones, in which white is adapted (ICC.1:2022, annex E)."""

_COLORANTS = (b"rXYZ", b"gXYZ", b"bXYZ")
_CURVES = (b"rTRC", b"gTRC", b"bTRC")
_MOST_TAGS = 200


@dataclass(frozen=True)
class GammaCurve:
    """A parametric curve: (a·x + b)^g + e from x = d on, c·x + f below.

    References
    ----------
    ICC.1:2022, section 10.18 (`parametricCurveType`).
    """

    g: float
    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 0.0
    f: float = 0.0

    def __call__(self, x: FloatArray) -> FloatArray:
        """Return the light of samples 0…1; the curve continues beyond 1, and is mirrored below 0."""
        size = np.abs(x)
        power = np.maximum(self.a * size + self.b, 0.0) ** self.g + self.e
        light: FloatArray = np.sign(x) * np.where(size >= self.d, power, self.c * size + self.f)
        return light


@dataclass(frozen=True, eq=False)
class TableCurve:
    """A curve as a table of evenly spaced values; linear between them, a straight line beyond 1."""

    values: FloatArray

    def __call__(self, x: FloatArray) -> FloatArray:
        """Return the light of samples."""
        size = np.abs(x)
        inside = np.interp(size, np.linspace(0, 1, len(self.values)), self.values)
        light: FloatArray = np.sign(x) * np.where(size > 1, size * self.values[-1], inside)
        return light


Curve = GammaCurve | TableCurve


@dataclass(frozen=True, eq=False)
class Profile:
    """The content of an ICC profile.

    Attributes
    ----------
    name
        Its description.
    space
        Colour space of the samples, as the header has it: "RGB", "GRAY", "CMYK", "Lab" …
    tables
        Whether it holds tables from the samples to colours, which take precedence over matrix and curves.
    curves
        From samples to light: three for RGB with a matrix, one for grey, empty where there are none.
    matrix
        (3, 3), from linear RGB to XYZ relative to D50. Rows are scaled to add up to D50, so grey stays grey.
        None where there is none.
    """

    name: str
    space: str
    tables: bool
    curves: tuple[Curve, ...] = ()
    matrix: FloatArray | None = None


def read_profile(data: bytes) -> Profile:
    """Read an ICC profile, version 2 or 4.

    Raises
    ------
    FormatError
        If it is cut short or breaks the format's rules.

    References
    ----------
    ICC.1:2022, sections 7.2, 8 and 10.
    """
    if len(data) < 132 or data[36:40] != b"acsp":
        raise FormatError("profile has no ICC header")
    count = struct.unpack_from(">I", data, 128)[0]
    if count > _MOST_TAGS or 132 + 12 * count > len(data):
        raise FormatError(f"profile has {count} tags in {len(data)} bytes")
    tags: dict[bytes, bytes] = {}
    for n in range(count):
        name, start, size = struct.unpack_from(">4sII", data, 132 + 12 * n)
        if start + size > len(data):
            raise FormatError(f"profile has a tag that ends at byte {start + size} of {len(data)}")
        tags[name] = data[start : start + size]
    space = data[16:20].decode("latin-1").strip()
    described = partial(Profile, _name(tags.get(b"desc", b"")), space, b"A2B0" in tags)
    try:
        if space == "RGB" and data[20:24] == b"XYZ " and all(tag in tags for tag in (*_COLORANTS, *_CURVES)):
            matrix = np.array([struct.unpack_from(">3i", tags[tag], 8) for tag in _COLORANTS]).T / 65536
            white = matrix.sum(axis=1)
            if not (white > 0.1).all():
                raise FormatError("profile has an invalid white")
            matrix *= (D50 / white)[:, None]
            return described(tuple(_curve(tags[tag]) for tag in _CURVES), matrix)
        if space == "GRAY" and b"kTRC" in tags:
            return described((_curve(tags[b"kTRC"]),))
    except struct.error:
        raise FormatError("profile has a tag that is too short") from None
    return described()


def rgb_profile(
    name: str, curve: Curve, given: Chromaticities, *, neutral: tuple[float, float] | None = None
) -> Profile | None:
    """Return the profile of RGB with stated primaries, None if they span no triangle.

    Parameters
    ----------
    name
        Its description.
    curve
        From samples to light, for all three.
    given
        Primaries and white.
    neutral
        The colour that becomes white, if it is not their white.

    References
    ----------
    SMPTE RP 177, on the matrix.
    """
    *primaries, white = (_xyz(place) for place in given)
    target = white if neutral is None else _xyz(neutral)
    columns = np.stack(primaries, axis=1)
    if not np.isfinite(columns).all() or abs(np.linalg.det(columns)) < 1e-6:
        return None
    light = columns * np.linalg.solve(columns, white / white[1])
    gains = (_BRADFORD @ D50) / (_BRADFORD @ (target / target[1]))
    adapted = np.linalg.solve(_BRADFORD, gains[:, None] * _BRADFORD)
    matrix = adapted @ light
    return Profile(name, "RGB", False, (curve,) * 3, matrix) if np.isfinite(matrix).all() else None


def _xyz(place: tuple[float, float]) -> FloatArray:
    x, y = place
    return np.array([x, y, 1 - x - y])


def _curve(tag: bytes) -> Curve:
    if tag[:4] == b"para":
        kind = struct.unpack_from(">H", tag, 8)[0]
        if kind > 4:
            raise FormatError(f"profile has a curve of type {kind}; allowed: 0 to 4")
        g, *rest = (value / 65536 for value in struct.unpack_from(f">{(1, 3, 4, 5, 7)[kind]}i", tag, 12))
        match kind:
            case 0:
                return _checked(GammaCurve(g))
            case 1 | 2:
                # Below -b/a the curve is flat, at 0 or at c.
                a, b = rest[:2]
                flat = rest[2] if kind == 2 else 0.0
                return _checked(GammaCurve(g, a, b, 0.0, -b / a if a else 0.0, flat, flat))
            case _:
                return _checked(GammaCurve(g, *rest))
    if tag[:4] != b"curv":
        raise FormatError(f"profile has a curve of kind {tag[:4].decode('latin-1')!r}; allowed: curv, para")
    count = struct.unpack_from(">I", tag, 8)[0]
    if count == 0:
        return GammaCurve(1.0)
    if count == 1:
        return _checked(GammaCurve(struct.unpack_from(">H", tag, 12)[0] / 256))
    if 12 + 2 * count > len(tag):
        raise FormatError(f"profile has a curve of {count} values in {len(tag)} bytes")
    values: NDArray[np.uint16] = np.frombuffer(tag, ">u2", count, 12)
    return TableCurve(values / 65535)


def _checked(curve: GammaCurve) -> GammaCurve:
    if not 0 < curve.g <= 16:
        raise FormatError(f"profile has a curve with the exponent {curve.g:g}; allowed: above 0, up to 16")
    return curve


def _name(tag: bytes) -> str:
    """Return a description, of version 2 (ASCII) or 4 (the first of its languages)."""
    form: Literal["ascii", "utf-16-be"] = "ascii"
    text = b""
    if tag[:4] == b"desc" and len(tag) >= 12:
        text = tag[12 : 12 + struct.unpack_from(">I", tag, 8)[0]]
    elif tag[:4] == b"mluc" and len(tag) >= 28:
        size, start = struct.unpack_from(">II", tag, 20)
        form, text = "utf-16-be", tag[start : start + size]
    words = " ".join("".join(c if c.isprintable() else " " for c in text.decode(form, "ignore")).split())
    return words[:60] or "no name"
