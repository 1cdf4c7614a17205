"""All options: name, default, meaning and range of each, defined once for library and command line.

Nothing heavy is imported here: ``upholster --help`` is generated from these fields.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from inspect import cleandoc
from numbers import Integral, Real
from os import PathLike, fspath
from types import UnionType
from typing import Any, Literal, TypeAlias, TypeVar, cast, get_args, get_origin

from upholster.conditions import read_conditions
from upholster.errors import InputError, nearest
from upholster.formats import OUTPUTS, suffixes_of
from upholster.guide_texts import parse_again, parse_guide, parse_put, parse_zone
from upholster.lengths import read_length
from upholster.shown import on_a_line

__all__ = [
    "METHODS",
    "QUALITY",
    "ModelOptions",
    "Quality",
    "SampleOptions",
    "SynthesisOptions",
    "TextureFormat",
    "WriteOptions",
    "check_quality",
    "chosen",
    "differing",
    "settled_options",
]

METHODS = ("quilt", "paper", "pixel")
SEARCHES = ("coherent", "full")
DISPLACED_BY = ("height", "luminance")

TextureFormat = Literal["auto", "png", "jpeg", "webp"]

QUALITY = 46.0
"""PSNR in dB at which a sample's stream ends by default: no loss is visible above it (docs/decisions.md)."""

Quality = float | Literal["lossless"]

_SAMPLE, _MAPS, _MODEL, _SCALE, _GUIDES, _SYNTHESIS, _PAPER, _PIXEL, _OUTPUT, _STREAM = (
    "Sample",
    "Maps",
    "Model",
    "Scale and direction",
    "Guides",
    "Synthesis",
    "Method paper",
    "Method pixel",
    "Output",
    "Stream",
)

Kind = TypeVar("Kind", "SampleOptions", "ModelOptions", "SynthesisOptions", "WriteOptions")
Settled = TypeVar("Settled", bound="SynthesisOptions")
Options: TypeAlias = "SampleOptions | ModelOptions | SynthesisOptions | WriteOptions"


def _about(
    panel: str,
    text: str,
    *,
    metavar: str | None = None,
    only: str | tuple[str, ...] = METHODS,
    flag: str | None = None,
) -> dict[str, Any]:
    """Return a field's metadata: panel, help text, and the methods that it applies to."""
    only = (only,) if isinstance(only, str) else only
    return {"panel": panel, "help": text, "metavar": metavar, "only": only, "flag": flag}


def _documented(kind: type[Any]) -> type[Any]:
    """Add the fields' help to a class's docstring, as a section of attributes."""
    attributes = [f"{entry.name}\n    {entry.metadata['help']}" for entry in fields(kind)]
    kind.__doc__ = "\n".join([cleandoc(kind.__doc__ or ""), "", "Attributes", "----------", *attributes])
    return kind


def chosen(kind: type[Kind], base: Kind | Mapping[str, Any] | None = None, **choices: Any) -> Kind:
    """Return options of a kind: `base` with `choices` applied; a choice of None is ignored.

    Raises
    ------
    InputError
        For an unknown name, or a value that the options refuse; also if a choice belongs to another method,
        even if it is that option's default.
    """
    if base is None or isinstance(base, Mapping):
        choices = dict(base or {}) | choices
        base = kind()
    if not isinstance(base, kind):
        raise InputError(f"options are a {type(base).__name__}; allowed: {kind.__name__}, or options by name")
    known = {entry.name: entry for entry in fields(kind)}
    for name in choices:
        if name not in known:
            raise InputError(f"unknown option {name!r}; {nearest(str(name), known)}")
    given = {name: value for name, value in choices.items() if value is not None}
    found = replace(base, **given)
    if isinstance(found, SynthesisOptions):
        _check_owner(found.method, [known[name] for name in given])
    return found


def differing(options: "Options") -> dict[str, Any]:
    """Return the options that differ from their defaults, by name."""
    values = {entry.name: (getattr(options, entry.name), entry.default) for entry in fields(options)}
    return {name: value for name, (value, default) in values.items() if value != default}


def settled_options(options: "SynthesisOptions", kind: type[Settled], **found: Any) -> Settled:
    """Return options as a method's own kind: open values come from `found`, or are the method's defaults."""
    given = {entry.name: getattr(options, entry.name) for entry in fields(options)} | found
    return kind(**{name: value for name, value in given.items() if value is not None})


_WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    bool: "True or False",
    str: "a text",
    tuple[int, int]: "two whole numbers",
    tuple[float, float]: "two numbers",
    tuple[str, ...]: "texts",
}
"""The types that an option can have, in words for messages."""


def check_quality(sample_quality: object) -> None:
    """Raise InputError for a quality that is neither 20 to 80 dB, nor "lossless", nor None."""
    if sample_quality is None or (isinstance(sample_quality, str) and sample_quality == "lossless"):
        return
    number = isinstance(sample_quality, Real) and not isinstance(sample_quality, bool)
    if not number or not 20 <= float(cast(float, sample_quality)) <= 80:
        raise InputError(
            f"sample_quality is {on_a_line(sample_quality)}; allowed: 20 to 80 (dB), or lossless"
        )


def _settle_types(options: "ModelOptions | SynthesisOptions | WriteOptions") -> None:
    """Bring each option to its type: NumPy's numbers to Python's, lists to tuples; refuse others."""
    for entry in fields(options):
        if isinstance(entry.type, str):  # the direction, which has many forms
            continue
        kinds = get_args(entry.type) if isinstance(entry.type, UnionType) else (entry.type,)
        kinds = tuple(str if get_origin(kind) is Literal else kind for kind in kinds)
        value = getattr(options, entry.name)
        try:
            settled_value = next(found for kind in kinds for found in _as_kind(kind, value))
        except StopIteration:
            allowed = " or ".join(_WORDS[kind] for kind in kinds if kind in _WORDS)
            raise InputError(f"{entry.name} is {on_a_line(value)}; allowed: {allowed}") from None
        object.__setattr__(options, entry.name, settled_value)


def _as_kind(kind: Any, value: Any) -> list[Any]:
    """Return `value` converted to a type, in a list; the list is empty if it can not be converted."""
    if kind is type(None):
        return [None] if value is None else []
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return [bool(value)] if kind is bool else []
    if kind is int:
        # 4e6 is a whole number as well.
        whole = isinstance(value, Integral) or (isinstance(value, Real) and float(value).is_integer())
        return [int(value)] if whole else []
    if kind is float:
        return [float(value)] if isinstance(value, Real) else []
    if kind is str:
        return [value] if isinstance(value, str) else []
    if get_origin(kind) is tuple and not isinstance(value, (str, bytes)):
        parts = _members(value)
        if get_args(kind)[1:] == (Ellipsis,):
            kind = tuple[(get_args(kind)[0],) * len(parts or ())]  # type: ignore[misc]  # built at run time
        if parts is not None and len(parts) == len(get_args(kind)):
            found = [_as_kind(part, one) for part, one in zip(get_args(kind), parts, strict=True)]
            return [tuple(one[0] for one in found)] if all(found) else []
    return []


def _members(value: Any) -> list[Any] | None:
    """Return the members of a list, tuple or flat array; None if `value` is none of them."""
    if isinstance(value, Sequence) or getattr(value, "ndim", None) == 1:
        return list(value)
    return None


def _direction_text(direction: Any) -> Any:
    """Return a direction as text if it is a number of degrees or three numbers; others unchanged."""
    if isinstance(direction, str) or direction is None or callable(direction):
        return direction
    if isinstance(direction, Mapping):
        return {str(name): str(_direction_text(one)) for name, one in direction.items()}
    parts = [direction] if isinstance(direction, Real) else _members(direction) or []
    if len(parts) not in (1, 3) or not all(isinstance(part, Real) for part in parts):
        raise InputError(
            f"direction is {on_a_line(direction)}; allowed: level, u, v, degrees, a vector as (x, y, z) or "
            "'x,y,z', 'around:z', or a function"
        )
    return ",".join(repr(float(part)).removesuffix(".0") for part in parts)


def _check_owner(method: str, asked: "list[Field[Any]]") -> None:
    for entry in asked:
        owners = entry.metadata["only"]
        if method not in owners:
            allowed = (
                other.name
                for other in fields(SynthesisOptions)
                if method in other.metadata["only"] and other.name != "method"
            )
            named = " and ".join(map(repr, owners))
            raise InputError(
                f"{entry.name} belongs to method {named}; allowed with {method!r}: {', '.join(allowed)}"
            )


@_documented
@dataclass(frozen=True, slots=True, kw_only=True)
class SampleOptions:
    """How a sample is read: its maps, and how a photo is prepared (all maps of a material alike).

    The allowed values depend on the photo, and are checked when it is read.
    """

    rectify: (
        tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]] | None
    ) = field(
        default=None,
        metadata=_about(
            _SAMPLE,
            "Four corners of a rectangle on the wall, in pixels of the photo: top left, top right, bottom "
            "right, bottom left. The sample is this rectangle, seen from the front.",
            metavar="X,Y X,Y X,Y X,Y",
        ),
    )
    crop: tuple[int, int, int, int] | None = field(
        default=None, metadata=_about(_SAMPLE, "Use this part, in pixels.", metavar="X,Y,W,H")
    )
    resize: int | str | tuple[int, int] | None = field(
        default=None, metadata=_about(_SAMPLE, "Resize to this longer side, or size.", metavar="N|WxH")
    )
    even_light: bool = field(
        default=False,
        metadata=_about(
            _SAMPLE,
            "Remove vignetting and slow shading: variations over half the sample or more.",
        ),
    )
    use: str | None = field(
        default=None,
        metadata=_about(
            _SAMPLE,
            "Use only pixels that this image, of the photo's size, shows white: no window, no finger. Or "
            "`alpha`: pixels that the photo's own alpha shows; it then is no transparency. Method quilt.",
            metavar="MASK",
        ),
    )
    maps: dict[str, str] | None = field(
        default=None,
        metadata=_about(
            _MAPS,
            "A map of the material whose name does not show its role: `roughness=x.png`, `orm=y.jpg` …",
            metavar="ROLE=FILE",
            flag="--map",
        ),
    )
    normal: str | None = field(
        default=None,
        metadata=_about(
            _MAPS,
            "Green of the normal map points upward (gl: OpenGL) or downward (dx: DirectX). Default: from its "
            "file name or the height map.",
            metavar="gl|dx",
        ),
    )

    def __post_init__(self) -> None:
        if self.maps is not None and not isinstance(self.maps, Mapping):
            raise InputError(f"maps is a {type(self.maps).__name__}; allowed: files by role")
        if self.use is not None and not (isinstance(self.use, (str, PathLike)) and fspath(self.use)):
            raise InputError(f"use is {on_a_line(self.use)}; allowed: an image's file, or 'alpha'")
        object.__setattr__(self, "use", None if self.use is None else fspath(self.use))

    @property
    def mask(self) -> str | None:
        """The image that shows which pixels are used; None without one."""
        return None if self.use == "alpha" else self.use

    @property
    def preparing(self) -> dict[str, Any]:
        """How a photo is prepared: arguments of `upholster.read_exemplar`."""
        names = "rectify", "crop", "resize", "even_light"
        return {name: getattr(self, name) for name in names}


@_documented
@dataclass(frozen=True, slots=True, kw_only=True)
class ModelOptions:
    """How a model's file is read.

    Raises
    ------
    InputError
        If a value is not allowed.
    """

    part: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _MODEL,
            "Cover only these parts, by the name of part, object or material: `Seat`, `'Leg*'`; `'sink#2'` "
            "is the second sink; repeatable. `upholster info` lists them. Default: all.",
            metavar="NAME",
        ),
    )
    uv: str = field(
        default="new",
        metadata=_about(
            _MODEL,
            "keep: charts cut as the model's own texture coordinates are cut, which may not overlap, and "
            "packed again; new: charts that we make.",
            metavar="new|keep",
        ),
    )
    unit: str | None = field(
        default=None,
        metadata=_about(
            _MODEL,
            "The file's unit, if the file does not state it: mm, cm, m, in, ft.",
            metavar="UNIT",
        ),
    )
    up: str | None = field(
        default=None,
        metadata=_about(
            _MODEL, "Which axis is up in the file; default: y in GLB, glTF and OBJ, else z.", metavar="y|z"
        ),
    )
    deviation: str | None = field(
        default=None,
        metadata=_about(
            _MODEL,
            "Largest distance of triangles from the faces of a CAD model: `0.1mm`. Default: a two-thousandth "
            "of its size.",
            metavar="LENGTH",
        ),
    )
    unique: bool = field(
        default=False,
        metadata=_about(
            _MODEL,
            "If a shape of a CAD model is in several places, cover each place separately. Default: cover it "
            "once and show it in all.",
        ),
    )

    def __post_init__(self) -> None:
        if isinstance(self.part, str):
            object.__setattr__(self, "part", (self.part,))
        _settle_types(self)
        if self.uv not in ("new", "keep"):
            raise InputError(f"uv is {self.uv!r}; allowed: new, keep")


@_documented
@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisOptions:
    """How a surface is covered. Options of one method are refused by the others.

    Raises
    ------
    InputError
        If a value is out of range, belongs to another method, or conflicts with another option.
    """

    texels: int | tuple[int, int] | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Number of texels in all, 64 to 2^31: `4M`. Or, on a surface of one patch, width and height of a "
            "flat texture with one texel per pixel of the sample: `512x512`. Default: one texel per pixel of "
            "the sample, at most 8M in all.",
            metavar="N|WxH",
            only="quilt",
        ),
    )
    density: float | None = field(
        default=None, metadata=_about(_SCALE, "Texels per model unit, instead of --texels.", only="quilt")
    )
    sample_size: float | str | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Width of the sample in model units, or with a unit if the model has one: `30cm`. Default: a "
            "sixth of the model's diagonal.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    element_size: float | str | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Size of the element that repeats in the sample, a brick or a plank, instead of --sample-size: "
            "`21cm`. This is its longer side; if only rows repeat, their distance.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    # A string, for the type needs NumPy: `upholster.charts.directions.Vectors`.
    direction: "str | float | Sequence[float] | Mapping[str, str] | Callable[[Any], Any] | None" = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Direction of the sample's rows: level (along lines of equal z), along the patches, at an angle "
            "to that, along a vector, or round an axis; on CAD models along or around the axes of its faces; "
            "or given by red and green of an image over the texture coordinates. "
            "On models also per part, repeatable: `Shaft=along`; names as for --part. "
            "Default: along the patches, the longer way round a ring; level where patches do not agree.",
            metavar="[PART=]level|u|v|DEG|X,Y,Z|around:AXIS|along|around|IMAGE",
            only="quilt",
        ),
    )
    stroke: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Near x,y,z rows run along dx,dy,dz; or along a line near it, `X,Y,Z/X,Y,Z/X,Y,Z`; repeatable. "
            "Or a .json file of such strokes and lines.",
            metavar="X,Y,Z:DX,DY,DZ",
            only="quilt",
        ),
    )
    size_map: str | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "Scale the sample by LOW where a map is 0, by HIGH where it is 1, each 1/8 to 8: "
            "`height=0.5,2`. The map is a TARGET as for --guide.",
            metavar="TARGET=LOW,HIGH",
            only="quilt",
        ),
    )
    guide: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "Where TARGET has a value on the surface, show parts of the sample that have the same value in "
            "SAMPLE; repeatable. "
            "SAMPLE: an image of the sample's size, `luminance`, or one of its maps, as `height`. "
            "TARGET: an image over the flat texture or the model's texture coordinates, `colors`, "
            "`part:NAME`, `height`, `slope`, `facing:z`, `curvature`, `occlusion`, `noise`, a ball "
            "`x,y,z:r`, a .json file of values; a prefix `1-` inverts it, a suffix `>0.5` compares it.",
            metavar="SAMPLE=TARGET[@WEIGHT]",
            only="quilt",
        ),
    )
    labels: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "The same with colours that are equal or not: texture by numbers.",
            metavar="SAMPLE=TARGET[@WEIGHT]",
            only="quilt",
        ),
    )
    zone: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "Use another sample, optionally of another width, where TARGET, as for --guide, is white; "
            "repeatable: where zones overlap, the last one counts.",
            metavar="SAMPLE[@LENGTH]=TARGET",
            only="quilt",
        ),
    )
    blend: float | str | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "Borders of zones fray over this width: pieces of both samples show there. Default: borders are "
            "where TARGET has them, and follow elements nearby.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    again: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "Lay this region again, with another seed; everything else stays. Repeatable, applied in order. "
            "REGION: where a TARGET, as for --guide, is white: `0,0,1:0.3`, `part:Seat`.",
            metavar="REGION[@SEED]",
            only="quilt",
        ),
    )
    put: tuple[str, ...] | None = field(
        default=None,
        metadata=_about(
            _GUIDES,
            "Put this piece there; the rest of the texture grows round it; repeatable. PIECE: an image, "
            "optionally with its width, `sign.png@20cm` (its alpha is its outline), or a part of the sample, "
            "`X,Y,W,H` in pixels. `*SIZE` scales it; `@DEG` turns it clockwise. On a flat texture X,Y are in "
            "pixels.",
            metavar="PIECE=X,Y,Z[*SIZE][@DEG]",
            only="quilt",
        ),
    )
    crease: float | None = field(
        default=None,
        metadata=_about(
            _SCALE,
            "The texture is interrupted at edges where the surface turns by at least this many degrees, "
            "1 to 180. Default: it continues where directions do.",
            metavar="DEG",
            only="quilt",
        ),
    )
    fit: bool = field(
        default=False,
        metadata=_about(
            _SCALE,
            "On CAD models, with the direction along or around: change the sample's size by up to 3 %, so "
            "that a whole number of its periods goes round.",
            only="quilt",
        ),
    )
    tileable: bool = field(
        default=False, metadata=_about(_SCALE, "Make a flat texture that wraps both ways.", only="quilt")
    )
    method: str = field(
        default="quilt",
        metadata=_about(
            _SYNTHESIS,
            "quilt: one texture over the whole surface; paper: the paper's own, patch by patch; pixel: texel "
            "by texel, which the paper compares itself with.",
        ),
    )
    block: int | None = field(
        default=None,
        metadata=_about(
            _SYNTHESIS,
            "Side of a block in pixels of the sample, 8 to 512. Default: from the sample's structure. "
            "With method paper in texels, a multiple of 2^levels up to 256; default 32.",
            only=("quilt", "paper"),
        ),
    )
    overlap: int | None = field(
        default=None,
        metadata=_about(
            _SYNTHESIS,
            "Width of the overlap of blocks in the same unit: 4 to half a block, default three tenths. With "
            "method paper a multiple of 2^levels, a block divided by 3, 4, …; default 8.",
            only=("quilt", "paper"),
        ),
    )
    evenness: float = field(
        default=0.2,
        metadata=_about(
            _SYNTHESIS,
            "Cost of using a part of the sample more often than others, 0 to 10.",
            only="quilt",
        ),
    )
    variety: float = field(
        default=0.2,
        metadata=_about(
            _SYNTHESIS,
            "Cost of using a part of the sample again near where it was used, 0 to 10.",
            only="quilt",
        ),
    )
    phase: float | None = field(
        default=None,
        metadata=_about(
            _SYNTHESIS,
            "Cost of courses and rows that do not meet, for a sample that repeats, 0 to 10; 0 ignores them. "
            "Default: 2 on surfaces, 0.5 flat.",
            only="quilt",
        ),
    )
    tolerance: float = field(
        default=1.1,
        metadata=_about(
            _SYNTHESIS,
            "Draw each block from those that cost at most this many times the best, 1 to 2.",
            only="quilt",
        ),
    )
    shortlist: int = field(
        default=32,
        metadata=_about(
            _SYNTHESIS,
            "Number of candidates for a block that are compared at full resolution, 1 to 4096.",
            only="quilt",
        ),
    )
    mirror: bool = field(
        default=False,
        metadata=_about(
            _SYNTHESIS,
            "Also use blocks of the sample mirrored left to right: 2 symmetries. For samples without "
            "writing; the top stays on top.",
            only="quilt",
        ),
    )
    rotate: bool = field(
        default=False,
        metadata=_about(
            _SYNTHESIS,
            "Also use blocks of the sample rotated by quarter turns, for samples without an up: 4 "
            "symmetries, and 8 with --mirror.",
            only="quilt",
        ),
    )
    chart: int = field(
        default=512,
        metadata=_about(
            _PAPER,
            "Texels along each side of a patch, 8 to 16384; also with method pixel.",
            only=("paper", "pixel"),
        ),
    )
    edge_block: int | None = field(
        default=None,
        metadata=_about(
            _PAPER,
            "Side of the blocks along the seams between patches, in texels: a multiple of 2^levels up to "
            "256, more than two overlaps. Default: --block.",
            only="paper",
        ),
    )
    levels: int = field(
        default=3,
        metadata=_about(
            _PAPER, "Levels of the Haar transform, 1 to 6; also with method pixel.", only=("paper", "pixel")
        ),
    )
    threshold: float | None = field(
        default=None,
        metadata=_about(
            _PAPER,
            "Set the sample's Haar coefficients of a smaller magnitude to zero, for matching and for "
            "painting (the paper's equation 7): 0 or more, in the sample's own units.",
            only="paper",
        ),
    )
    coefficients: float | None = field(
        default=None,
        metadata=_about(
            _PAPER, "The same by share: all but the largest `7%` of them are set to zero.", metavar="7%",
            only="paper",
        ),
    )  # fmt: skip
    seams: bool = field(
        default=True, metadata=_about(_PAPER, "Repair the seams between patches.", only="paper")
    )

    search: str = field(
        default="coherent",
        metadata=_about(
            _PIXEL,
            "full: compare each texel with the whole sample, which takes minutes; coherent: with pixels that "
            "continue its neighbours, and pixels similar to those.",
            metavar="coherent|full",
            only="pixel",
        ),
    )

    def __repr__(self) -> str:
        return on_a_line(self, differing(self))

    def __post_init__(self) -> None:
        for name in ("stroke", "guide", "labels", "zone", "again", "put"):
            if isinstance(getattr(self, name), str):
                object.__setattr__(self, name, (getattr(self, name),))
        _settle_types(self)
        object.__setattr__(self, "direction", _direction_text(self.direction))
        if self.method not in METHODS:
            raise InputError(f"unknown method {self.method!r}; {nearest(self.method, METHODS)}")
        _check_owner(
            self.method,
            [entry for entry in fields(SynthesisOptions) if getattr(self, entry.name) != entry.default],
        )
        if not 1 <= self.levels <= 6:
            raise InputError(f"levels is {self.levels}; allowed: 1 to 6")
        if self.search not in SEARCHES:
            raise InputError(f"unknown search {self.search!r}; {nearest(self.search, SEARCHES)}")
        if self.method == "paper":
            self._check_paper()
        elif self.method == "quilt":
            self._check_quilt()
            self._check_scale()

    def _check_quilt(self) -> None:
        if self.block is not None and not 8 <= self.block <= 512:
            raise InputError(f"block is {self.block}; allowed: 8 to 512")
        if self.overlap is not None and self.block is not None and not 4 <= self.overlap <= self.block // 2:
            raise InputError(f"overlap is {self.overlap}; allowed: 4 to half a block ({self.block // 2})")
        for text in self.guide or ():
            parse_guide(text)
        for text in self.labels or ():
            parse_guide(text, "labels")
        for text in self.zone or ():
            parse_zone(text)
        if self.blend is not None and not self.zone:
            raise InputError(f"blend is {self.blend} without zones; allowed: with --zone")
        if self.blend is not None and not read_length(self.blend, name="blend").number > 0:
            raise InputError(f"blend is {self.blend}; allowed: a length above 0")
        for text in self.again or ():
            parse_again(text)
        for text in self.put or ():
            parse_put(text)
        for name, value, least, most in (
            ("evenness", self.evenness, 0, 10),
            ("variety", self.variety, 0, 10),
            ("phase", 0 if self.phase is None else self.phase, 0, 10),
            ("tolerance", self.tolerance, 1, 2),
            ("shortlist", self.shortlist, 1, 4096),
        ):
            if not least <= value <= most:
                raise InputError(f"{name} is {value:g}; allowed: {least} to {most}")

    def _check_paper(self) -> None:
        if self.threshold is not None and not 0 <= self.threshold < 1e9:
            raise InputError(f"threshold is {self.threshold:g}; allowed: 0 or more (a magnitude)")
        if self.coefficients is not None and not 0 < self.coefficients <= 1:
            raise InputError(f"coefficients is {self.coefficients:g}; allowed: above 0, at most 1")
        if self.threshold is not None and self.coefficients is not None:
            raise InputError("threshold and coefficients are both given; allowed: one of them")
        tile = 2**self.levels
        if self.edge_block is not None and not self.seams:
            raise InputError(f"edge_block is {self.edge_block} without seams; allowed: one of them")
        for name, side in (("block", self.block), ("edge_block", self.edge_block)):
            if side is not None and (not 2 * tile <= side <= 256 or side % tile):
                raise InputError(
                    f"{name} is {side}; allowed: multiples of 2^levels = {tile} from {2 * tile} to 256"
                )
        if self.block is None:
            return
        if self.overlap is not None and (
            not tile <= self.overlap < self.block / 2 or self.overlap % tile or self.block % self.overlap
        ):
            raise InputError(
                f"overlap is {self.overlap}; allowed: multiples of 2^levels = {tile} of which a block "
                f"({self.block}) is a multiple, less than half of it"
            )
        if self.edge_block is not None and self.overlap is not None and self.edge_block <= 2 * self.overlap:
            raise InputError(
                f"edge_block is {self.edge_block}; allowed: more than two overlaps ({2 * self.overlap})"
            )

    def _check_scale(self) -> None:
        kinds = self.direction.values() if isinstance(self.direction, Mapping) else [self.direction]
        if self.fit and not {"along", "around"}.intersection(kinds):
            raise InputError(
                f"fit is given with direction {on_a_line(self.direction)}; allowed: with along or around"
            )
        if self.crease is not None and not 1 <= self.crease <= 180:
            raise InputError(f"crease is {self.crease:g} degrees; allowed: 1 to 180")
        for name, size in (("sample size", self.sample_size), ("element size", self.element_size)):
            if isinstance(size, str):
                read_length(size, name=name)
        if self.sample_size is not None and self.element_size is not None:
            raise InputError("sample size and element size are both given; allowed: at most one of them")
        if not isinstance(self.texels, tuple):
            if self.tileable:
                raise InputError("tileable needs texels as width x height, on a surface of one patch")
            if self.texels is not None and self.density is not None:
                raise InputError("density and texels are both given; allowed: at most one of them")
            return
        for name in ("density", "sample_size", "element_size", "direction"):
            if getattr(self, name) is not None:
                width, height = self.texels
                raise InputError(f"{name} is given with texels {width}x{height}; allowed: one of them")


@_documented
@dataclass(frozen=True, slots=True)
class WriteOptions:
    """How models, pictures and streams are written.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    quads: int = field(
        default=20000,
        metadata=_about(_OUTPUT, "Quadrilaterals of the whole surface's mesh, 1 to 10,000,000."),
    )
    texture: TextureFormat = field(
        default="auto",
        metadata=_about(
            _OUTPUT,
            "Format of the textures in a GLB: png, jpeg, webp (smallest); auto: colours without alpha jpeg, "
            "all else png.",
        ),
    )
    quality: int = field(default=90, metadata=_about(_OUTPUT, "Quality of JPEG and WebP, 1 to 100."))
    normal_scale: float = field(
        default=1.0,
        metadata=_about(_OUTPUT, "Strength of a material's normal map in a GLB or picture, 0 to 100."),
    )
    padding: int | None = field(
        default=None,
        metadata=_about(
            _OUTPUT,
            "Texels around each chart in an atlas, continued from its neighbours; on a mesh, texels between "
            "two islands: 0 to 64. Default: 16; on a mesh 4, 8 or 16, by its texels.",
            metavar="N",
        ),
    )
    atlas_size: int | None = field(
        default=None,
        metadata=_about(
            _OUTPUT,
            "Height and width of every page of an atlas in texels: 256, 512 ... 8192. Default: pages as "
            "large as their charts need, 8192x8192 at most unless a single chart is larger.",
            metavar="N",
        ),
    )
    pot: bool = field(
        default=False,
        metadata=_about(_OUTPUT, "Make the sides of pages powers of two, as some engines require."),
    )
    lods: int = field(
        default=1,
        metadata=_about(
            _OUTPUT,
            "Number of files for each GLB, 1 to 8: `x.glb`, then `x_lod1.glb` with half the texels each way, "
            "`x_lod2.glb` with a quarter ...",
        ),
    )
    size: tuple[int, int] = field(
        default=(1024, 768),
        metadata=_about(_OUTPUT, "Width and height of a picture in pixels.", metavar="WxH"),
    )
    view: tuple[float, float] = field(
        default=(30.0, 30.0),
        metadata=_about(_OUTPUT, "Azimuth and elevation of a picture in degrees.", metavar="AZ,EL"),
    )
    supersample: int = field(default=2, metadata=_about(_OUTPUT, "Rays per pixel each way, 1 to 8."))
    displace: str | float | None = field(
        default=None,
        metadata=_about(
            _OUTPUT,
            f"In {' '.join(suffixes_of(kind for kind in OUTPUTS if kind.solid))} move the surface outward by "
            "the height map. This is the distance where the height is 1: `0.6mm`, or in model units; below 0 "
            "moves inward.",
            metavar="LENGTH",
        ),
    )
    displace_by: str = field(
        default="height",
        metadata=_about(
            _OUTPUT,
            "Displace by the height map, or by luminance if the sample has no height map.",
            metavar="height|luminance",
        ),
    )
    mid_level: float = field(
        default=0.0,
        metadata=_about(_OUTPUT, "The height that does not move, 0 to 1; lower ones move the other way."),
    )
    keep: str | None = field(
        default=None,
        metadata=_about(
            _OUTPUT,
            "Where nothing moves, such as a base that stays flat: `z<0.1mm`, `x>=0 and z<2`.",
            metavar="CONDITIONS",
        ),
    )
    triangles: int = field(
        default=500_000,
        metadata=_about(
            _OUTPUT,
            "Largest number of triangles of the displaced mesh, 1000 to 8,000,000: `2M`. Fewer are used if "
            "they suffice for the height map.",
            metavar="N",
        ),
    )
    wavelet: str | None = field(
        default=None,
        metadata=_about(
            _STREAM,
            "Wavelet that codes the sample: 9/7, 5/3 or haar (the paper's: the largest coefficients first). "
            "Default: haar with method paper; else 9/7, or 5/3 if the sample is kept lossless.",
        ),
    )
    wavelet_levels: int | None = field(
        default=None,
        metadata=_about(
            _STREAM,
            "Levels of that transform, 0 to 10. Default: three with haar, as in the paper; else by the "
            "sample's size.",
        ),
    )
    sample_quality: float | str = field(
        default=QUALITY,
        metadata=_about(
            _STREAM,
            "Quality at which the sample's stream ends: its PSNR in dB, 20 to 80, or `lossless`. No loss is "
            "visible above the default.",
            metavar="DB",
        ),
    )
    stream_bytes: int | None = field(
        default=None,
        metadata=_about(_STREAM, "Largest length in bytes: `8k`; 256 or more.", metavar="N", flag="--bytes"),
    )

    @property
    def stream_choices(self) -> list[str]:
        """The changed options that only streams use."""
        return [
            (entry.metadata["flag"] or entry.name).removeprefix("--")
            for entry in fields(self)
            if entry.metadata["panel"] == _STREAM and getattr(self, entry.name) != entry.default
        ]

    @property
    def packing(self) -> dict[str, Any]:
        """How pages of an atlas are laid out: arguments of `upholster.model.pack_atlas`."""
        return {"gutter": self.padding, "size": self.atlas_size, "powers": self.pot}

    @property
    def transform(self) -> dict[str, Any]:
        """How a stream transforms the sample: arguments of `upholster.encode_stream`."""
        return {"wavelet": self.wavelet, "levels": self.wavelet_levels, "sample_quality": self.sample_quality}

    def __repr__(self) -> str:
        return on_a_line(self, differing(self))

    def __post_init__(self) -> None:
        _settle_types(self)
        if self.texture not in get_args(TextureFormat):
            raise InputError(f"texture is {self.texture!r}; allowed: {', '.join(get_args(TextureFormat))}")
        if not 1 <= self.quality <= 100:
            raise InputError(f"quality is {self.quality}; allowed: 1 to 100")
        if not 0 <= self.normal_scale <= 100:
            raise InputError(f"normal_scale is {self.normal_scale:g}; allowed: 0 to 100")
        if self.padding is not None and not 0 <= self.padding <= 64:
            raise InputError(f"padding is {self.padding}; allowed: 0 to 64")
        if self.atlas_size not in (None, *(2**power for power in range(8, 14))):
            raise InputError(f"atlas_size is {self.atlas_size}; allowed: a power of two from 256 to 8192")
        if not 1 <= self.lods <= 8:
            raise InputError(f"lods is {self.lods}; allowed: 1 to 8")
        if not 1 <= self.quads <= 10_000_000:
            raise InputError(f"quads is {self.quads}; allowed: 1 to 10,000,000")
        if not all(1 <= side <= 16384 for side in self.size):
            raise InputError(f"size is {self.size[0]}x{self.size[1]}; allowed: 1 to 16384 each way")
        if not (-3600 <= self.view[0] <= 3600 and -90 <= self.view[1] <= 90):
            raise InputError(
                f"view is {self.view[0]:g},{self.view[1]:g}; "
                "allowed: azimuth -3600 to 3600, elevation -90 to 90"
            )
        if self.stream_bytes is not None and not 256 <= self.stream_bytes < 2**31:
            raise InputError(f"bytes is {self.stream_bytes}; allowed: at least 256")
        check_quality(self.sample_quality)
        if not 1 <= self.supersample <= 8:
            raise InputError(f"supersample is {self.supersample}; allowed: 1 to 8")
        self._check_displacement()

    def _check_displacement(self) -> None:
        if self.displace is None:
            for name in ("displace_by", "mid_level", "keep", "triangles"):
                if name in differing(self):
                    raise InputError(f"{name} is given without displace; allowed: with it")
            return
        if read_length(self.displace, name="displace").number == 0:
            raise InputError(f"displace is {self.displace!r}; allowed: above 0, or below to move inward")
        if self.displace_by not in DISPLACED_BY:
            raise InputError(f"displace_by is {self.displace_by!r}; allowed: {', '.join(DISPLACED_BY)}")
        if not 0 <= self.mid_level <= 1:
            raise InputError(f"mid_level is {self.mid_level:g}; allowed: 0 to 1")
        if not 1000 <= self.triangles <= 8_000_000:
            raise InputError(f"triangles is {self.triangles}; allowed: 1000 to 8,000,000")
        if self.keep is not None:
            read_conditions(self.keep)
