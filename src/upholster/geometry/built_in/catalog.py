"""The built-in surfaces by name, and the text form of a surface: ``torus:R=2,r=0.7`` or a file's name."""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from upholster.base.errors import InputError, nearest
from upholster.base.formats import SURFACE_SUFFIXES
from upholster.geometry.built_in.cyclide import ring_cyclide, torus
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cone, cylinder, ellipsoid, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.built_in.surface_files import read_surface
from upholster.geometry.patches.surface import Surface

__all__ = [
    "SURFACES",
    "SurfaceKind",
    "SurfaceLike",
    "SurfaceParameter",
    "as_surface",
    "surface_file",
    "surface_from_spec",
]

LENGTH = "1e-9 to 1e9"
UNIT = "model units"


@dataclass(frozen=True, slots=True)
class SurfaceParameter:
    """A parameter of a built-in surface, as texts for users.

    Attributes
    ----------
    name, default
        As written in ``name=value``; the default has the type of the value: float, int, a pair of ints, or
        text.
    allowed
        The allowed values.
    unit
        ``"model units"`` or empty.
    meaning
        Its meaning.
    """

    name: str
    default: float | int | tuple[int, int] | str
    allowed: str
    unit: str
    meaning: str

    def parse(self, text: str) -> object:
        """Return the value that `text` stands for, of the default's type; the builder checks limits."""
        wrong = InputError(f"{self.name} is {text[:40]!r}; allowed: {self.allowed}")
        if isinstance(self.default, str):
            return text
        if isinstance(self.default, float):
            try:
                return float(text)
            except ValueError:
                raise wrong from None
        sizes = re.fullmatch(r"([0-9]{1,9})(?:[x×]([0-9]{1,9}))?", text)
        if sizes is None or (sizes[2] is not None) != isinstance(self.default, tuple):
            raise wrong
        return (int(sizes[1]), int(sizes[2])) if isinstance(self.default, tuple) else int(sizes[1])

    @property
    def written(self) -> str:
        """The default as it is written after the equals sign."""
        if isinstance(self.default, tuple):
            return f"{self.default[0]}x{self.default[1]}"
        return f"{self.default:g}" if isinstance(self.default, float) else str(self.default)


@dataclass(frozen=True, slots=True)
class SurfaceKind:
    """A built-in surface.

    Attributes
    ----------
    name, description
        Its name, and one line about it.
    parameters
        All its parameters.
    patches
        Number of patches with the defaults.
    build
        The builder.
    number
        The number that stands for it in streams [SPEC.md, 2]. Numbers are never reused; 0 and 9 are control
        nets and meshes. None: streams store its control nets.
    biquadratic
        Other defaults that make its patches at most bi-quadratic; empty where there are none.
    """

    name: str
    description: str
    parameters: tuple[SurfaceParameter, ...]
    patches: int
    build: Callable[..., Surface]
    number: int | None = None
    biquadratic: Mapping[str, str] = field(default_factory=dict)


def _length(name: str, default: float, meaning: str, allowed: str = LENGTH) -> SurfaceParameter:
    return SurfaceParameter(name, default, allowed, UNIT, meaning)


_RING_SPANS = SurfaceParameter(
    "spans", (4, 4), "two even numbers from 4 to 256, like 4x4", "", "patches round the ring x round the tube"
)
_ROUND_SPANS = SurfaceParameter("spans", 4, "3 to 256", "", "patches round the axis")

SURFACES: dict[str, SurfaceKind] = {
    kind.name: kind
    for kind in (
        SurfaceKind(
            "cyclide",
            "ring Dupin cyclide: a ring, thick on one side and thin on the other",
            (
                _length("a", 6.0, "size of the ring: its outer circle has radius a + mu"),
                _length("c", 2.0, "unevenness: the tube's radius runs from mu - c to mu + c", "0 <= c < a"),
                _length("mu", 3.0, "mean radius of the tube", "c < mu <= a"),
                _RING_SPANS,
            ),
            16,
            ring_cyclide,
            1,
        ),
        SurfaceKind(
            "torus",
            "torus round the z axis",
            (
                _length("R", 2.0, "radius of the ring's middle circle"),
                _length("r", 0.7, "radius of the tube", "0 < r < R"),
                _RING_SPANS,
            ),
            16,
            torus,
            2,
        ),
        SurfaceKind(
            "sphere",
            "sphere, of six patches without poles or of eight octants",
            (
                _length("r", 1.0, "radius"),
                SurfaceParameter(
                    "tiling",
                    "six",
                    "six, octants",
                    "",
                    "six bi-quartic or eight bi-quadratic patches; octants by default with method paper",
                ),
            ),
            6,
            sphere,
            3,
            {"tiling": "octants"},
        ),
        SurfaceKind(
            "plane",
            "rectangle, facing up",
            (
                _length("width", 1.0, "extent along x"),
                _length("height", 1.0, "extent along y"),
                SurfaceParameter(
                    "spans", (1, 1), "two numbers from 1 to 256, like 1x1", "", "patches along y x along x"
                ),
            ),
            1,
            plane,
            4,
        ),
        SurfaceKind(
            "ellipsoid",
            "ellipsoid with its poles on the z axis",
            (
                _length("rx", 1.5, "half axis along x"),
                _length("ry", 1.0, "half axis along y"),
                _length("rz", 0.75, "half axis along z"),
            ),
            8,
            ellipsoid,
            5,
        ),
        SurfaceKind(
            "cylinder",
            "wall of an upright cylinder",
            (_length("r", 1.0, "radius"), _length("h", 2.0, "height"), _ROUND_SPANS),
            4,
            cylinder,
            6,
        ),
        SurfaceKind(
            "cone",
            "wall of an upright cone frustum",
            (
                _length("r1", 1.0, "radius at the bottom"),
                _length("r2", 0.4, "radius at the top; 0 gives a point", f"0, or {LENGTH}"),
                _length("h", 1.5, "height"),
                _ROUND_SPANS,
            ),
            4,
            cone,
            7,
        ),
        SurfaceKind(
            "vase",
            "vase with walls and a bottom, inside and outside",
            (_length("radius", 0.8, "of the belly"), _length("height", 2.4, "height"), _ROUND_SPANS),
            40,
            vase,
            8,
        ),
    )
}
"""The built-in surfaces, by name."""


SurfaceLike = Surface | str | os.PathLike[str]
"""A surface, its text form, or a surface's file."""


def as_surface(surface: SurfaceLike, *, biquadratic: bool = False) -> Surface:
    """Return the surface that a value stands for.

    Parameters
    ----------
    surface
        A surface; its text form, see `surface_from_spec`; or the path of a surface's file.
    biquadratic
        As for `surface_from_spec`.

    Raises
    ------
    InputError, FormatError
        If it is none of these, or as `surface_from_spec`.
    """
    return surface if isinstance(surface, Surface) else surface_from_spec(surface, biquadratic=biquadratic)


def surface_file(surface: SurfaceLike) -> str | None:
    """Return the file that a surface is read from, None without one."""
    if isinstance(surface, os.PathLike):
        return os.fspath(surface)
    text = surface if isinstance(surface, str) else ""
    return text if text.lower().endswith(SURFACE_SUFFIXES) else None


def surface_from_spec(text: str | os.PathLike[str], *, biquadratic: bool = False) -> Surface:
    """Make a surface from its text form.

    Parameters
    ----------
    text
        ``name`` or ``name:parameter=value,parameter=value`` of a built-in surface (`SURFACES`), such as
        ``cyclide:a=6,c=2,mu=3,spans=4x4``; or the name of a file that ends in ``.json``, ``.bpt`` or
        ``.bpt.txt``, as text or as a path.
    biquadratic
        Whether to take bi-quadratic patches, as the paper does, where the text leaves the choice open: the
        sphere then consists of eight octants, not of six bi-quartic patches.

    Raises
    ------
    InputError
        If the surface, a parameter or a value is unknown or out of range; names the nearest known name.
    FormatError
        If the file is damaged.
    """
    if not isinstance(text, (str, os.PathLike)):
        raise InputError(
            f"surface is a {type(text).__name__}; allowed: a Surface, a text such as 'torus:R=2,r=0.7', "
            "or a surface's file"
        )
    if not isinstance(biquadratic, bool):
        raise InputError(f"biquadratic is {biquadratic!r}; allowed: True or False")
    if (file := surface_file(text)) is not None:
        return read_surface(file)
    text = os.fspath(text)
    name, colon, rest = text.partition(":")
    name = name.strip()
    if name not in SURFACES:
        # A name with a dot or a slash is meant as a file's; the error is in its suffix.
        if "." in name or "/" in text or "\\" in text:
            return read_surface(text)
        raise InputError(f"unknown surface {name[:40]!r}; {nearest(name, SURFACES)}")
    kind = SURFACES[name]
    known = {parameter.name: parameter for parameter in kind.parameters}
    values: dict[str, str] = {}
    defaults = dict(kind.biquadratic) if biquadratic else {}
    for part in rest.split(",") if colon else []:
        key, equals, value = part.partition("=")
        key = key.strip()
        if not equals:
            raise InputError(f"{name}: {part[:40]!r} is no parameter=value; known: {', '.join(known)}")
        if key not in known:
            raise InputError(f"{name}: unknown parameter {key[:40]!r}; {nearest(key, known)}")
        if key in values:
            raise InputError(f"{name}: {key} is given twice; allowed: once")
        values[key] = value.strip()
    try:
        return kind.build(**{key: known[key].parse(value) for key, value in (defaults | values).items()})
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
