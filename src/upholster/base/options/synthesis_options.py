"""Options of a synthesis: scale and direction, guides, and the methods' own."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from numbers import Real
from typing import Any

from upholster.base.display import on_a_line
from upholster.base.errors import InputError, nearest
from upholster.base.guide_texts import parse_again, parse_guide, parse_put, parse_zone
from upholster.base.lengths import read_length
from upholster.base.options.direction_words import DIRECTIONS
from upholster.base.options.option_fields import METHODS, about, convert_types, differing, documented, members

__all__ = ["SynthesisOptions", "check_owner"]

_DIRECTIONS = tuple(row.word for row in DIRECTIONS)

SEARCHES = ("coherent", "full")

_SCALE, _GUIDES, _SYNTHESIS, _PAPER, _PIXEL = (
    "Scale and direction",
    "Guides",
    "Synthesis",
    "Method paper",
    "Method pixel",
)


@documented
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
        metadata=about(
            _SCALE,
            "Number of texels in all, 64 to 2^31: `4M`. Or, on a surface of one patch, width and height of a "
            "flat texture with one texel per pixel of the sample: `512x512`. Default: two texels per pixel "
            "of the sample each way, or one where two would make more than 8M; at most 8M in all.",
            metavar="N|WxH",
            only="quilt",
        ),
    )
    density: float | None = field(
        default=None, metadata=about(_SCALE, "Texels per model unit, instead of --texels.", only="quilt")
    )
    sample_size: float | str | None = field(
        default=None,
        metadata=about(
            _SCALE,
            "Width of the whole sample on the model, in model units, or with a unit if the model has one: "
            "`30cm`. Default: a sixth of the model's diagonal.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    element_size: float | str | None = field(
        default=None,
        metadata=about(
            _SCALE,
            "Size of one brick, plank or tile on the model, not of the whole sample: `21cm`. It sets "
            "--sample-size: with 4 bricks in the sample's width, to 84cm. This is the element's longer side; "
            "if only rows repeat, their distance.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    # A string, for the type needs NumPy: `upholster.charts.directions.direction.Vectors`.
    direction: "str | float | Sequence[float] | Mapping[str, str] | Callable[[Any], Any] | None" = field(
        default=None,
        metadata=about(
            _SCALE,
            "Direction of the sample's rows: "
            f"{', '.join(f'{row.word} ({row.meaning})' for row in DIRECTIONS if row.meaning)}, u or v of "
            "patches, an angle, a vector, or round an axis; on CAD models along or around the axes of faces; "
            "or red and green of an image over the texture coordinates. "
            "On models also per part, repeatable: `Shaft=along`; names as for --part. "
            "Default on models: level, but curvature on closed tubes and smooth on land. On patches: u, or "
            "the longer way round a closed ring; level where patches do not agree.",
            metavar=f"[PART=]{'|'.join(_DIRECTIONS)}|DEG|X,Y,Z|around:AXIS|IMAGE",
            only="quilt",
        ),
    )
    stroke: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
            _SCALE,
            "Near x,y,z rows run along dx,dy,dz; or along a line near it, `X,Y,Z/X,Y,Z/X,Y,Z`; repeatable. "
            "Or a .json file of such strokes and lines.",
            metavar="X,Y,Z:DX,DY,DZ",
            only="quilt",
        ),
    )
    size_map: str | None = field(
        default=None,
        metadata=about(
            _SCALE,
            "Scale the sample by LOW where a map is 0, by HIGH where it is 1, each 1/8 to 8: "
            "`height=0.5,2`. The map is a TARGET as for --guide.",
            metavar="TARGET=LOW,HIGH",
            only="quilt",
        ),
    )
    guide: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
            _GUIDES,
            "Where TARGET has a value on the surface, show parts of the sample that have the same value in "
            "SAMPLE; repeatable. "
            "SAMPLE: an image of the sample's size, `luminance`, or one of its maps, as `height`. "
            "TARGET: an image over the flat texture or the model's texture coordinates, `colors`, "
            "`part:NAME`, `height`, `slope`, `facing:z`, `curvature`, `occlusion`, `noise`, a ball "
            "`x,y,z:r`, a .json file of values; a prefix `1-` inverts it, a suffix `>0.5` compares it; "
            "`height<0.3 and slope>0.5` joins several.",
            metavar="SAMPLE=TARGET[@WEIGHT]",
            only="quilt",
        ),
    )
    labels: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
            _GUIDES,
            "The same with colours that are equal or not: texture by numbers.",
            metavar="SAMPLE=TARGET[@WEIGHT]",
            only="quilt",
        ),
    )
    zone: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
            _GUIDES,
            "Use another sample, optionally of another width, where TARGET, as for --guide, is white; "
            "repeatable: where zones overlap, the last one counts.",
            metavar="SAMPLE[@LENGTH]=TARGET",
            only="quilt",
        ),
    )
    blend: float | str | None = field(
        default=None,
        metadata=about(
            _GUIDES,
            "Borders of zones fray over this width: pieces of both samples show there. Default: borders are "
            "where TARGET has them, and follow elements nearby.",
            metavar="LENGTH",
            only="quilt",
        ),
    )
    again: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
            _GUIDES,
            "Lay this region again, with another seed; everything else stays. Repeatable, applied in order. "
            "REGION: where a TARGET, as for --guide, is white: `0,0,1:0.3`, `part:Seat`.",
            metavar="REGION[@SEED]",
            only="quilt",
        ),
    )
    put: tuple[str, ...] | None = field(
        default=None,
        metadata=about(
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
        metadata=about(
            _SCALE,
            "The texture is interrupted at edges where the surface turns by at least this many degrees, "
            "1 to 180. Default: it continues where directions do.",
            metavar="DEG",
            only="quilt",
        ),
    )
    fit: bool = field(
        default=False,
        metadata=about(
            _SCALE,
            "On CAD models, with the direction along or around: change the sample's size by up to 3 %, so "
            "that a whole number of its periods goes round.",
            only="quilt",
        ),
    )
    tileable: bool = field(
        default=False, metadata=about(_SCALE, "Make a flat texture that wraps both ways.", only="quilt")
    )
    method: str = field(
        default="quilt",
        metadata=about(
            _SYNTHESIS,
            "quilt: one texture over the whole surface; paper: the paper's own, patch by patch; pixel: texel "
            "by texel, which the paper compares itself with.",
        ),
    )
    block: int | None = field(
        default=None,
        metadata=about(
            _SYNTHESIS,
            "Side of a block in pixels of the sample, 8 to 512. Default: 3/8 of its shorter "
            "side, 5/16 if it repeats in two directions, less "
            "on curved surfaces. With method paper in texels, a multiple of 2^levels up to 256; default 32.",
            only=("quilt", "paper"),
        ),
    )
    overlap: int | None = field(
        default=None,
        metadata=about(
            _SYNTHESIS,
            "Width of the overlap of blocks in the same unit: 4 to half a block, default three tenths. With "
            "method paper a multiple of 2^levels, a block divided by 3, 4, …; default 8.",
            only=("quilt", "paper"),
        ),
    )
    phase: float = field(
        default=2.0,
        metadata=about(
            _SYNTHESIS,
            "Cost of courses and rows that do not meet, for a sample that repeats, 0 to 10; 0 ignores them.",
            only="quilt",
        ),
    )
    variety: float = field(
        default=0.2,
        metadata=about(
            _SYNTHESIS,
            "How much more a part of the sample costs where blocks nearby show it, as a share of its cost, 0 "
            "to 10. Higher values repeat less and fit less.",
            only="quilt",
        ),
    )
    shortlist: int = field(
        default=128,
        metadata=about(
            _SYNTHESIS,
            "Number of candidates for a block that are compared at full resolution, 1 to 4096.",
            only="quilt",
        ),
    )
    mirror: bool = field(
        default=False,
        metadata=about(
            _SYNTHESIS,
            "Also use blocks of the sample mirrored left to right: 2 symmetries. For samples without "
            "writing; the top stays on top.",
            only="quilt",
        ),
    )
    rotate: bool = field(
        default=False,
        metadata=about(
            _SYNTHESIS,
            "Also use blocks of the sample rotated by quarter turns, for samples without an up: 4 "
            "symmetries, and 8 with --mirror.",
            only="quilt",
        ),
    )
    chart: int = field(
        default=512,
        metadata=about(
            _PAPER,
            "Texels along each side of a patch, 8 to 16384; also with method pixel.",
            only=("paper", "pixel"),
        ),
    )
    edge_block: int | None = field(
        default=None,
        metadata=about(
            _PAPER,
            "Side of the blocks along the seams between patches, in texels: a multiple of 2^levels up to "
            "256, more than two overlaps. Default: --block.",
            only="paper",
        ),
    )
    levels: int = field(
        default=3,
        metadata=about(
            _PAPER, "Levels of the Haar transform, 1 to 6; also with method pixel.", only=("paper", "pixel")
        ),
    )
    threshold: float | None = field(
        default=None,
        metadata=about(
            _PAPER,
            "Set the sample's Haar coefficients of a smaller magnitude to zero, for matching and for "
            "painting (the paper's equation 7): 0 or more, in the sample's own units.",
            only="paper",
        ),
    )
    coefficients: float | None = field(
        default=None,
        metadata=about(
            _PAPER, "The same by share: all but the largest `7%` of them are set to zero.", metavar="7%",
            only="paper",
        ),
    )  # fmt: skip
    seams: bool = field(
        default=True, metadata=about(_PAPER, "Repair the seams between patches.", only="paper")
    )

    search: str = field(
        default="coherent",
        metadata=about(
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
        convert_types(self)
        object.__setattr__(self, "direction", _direction_text(self.direction))
        if self.method not in METHODS:
            raise InputError(f"unknown method {self.method!r}; {nearest(self.method, METHODS)}")
        check_owner(
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
            ("phase", self.phase, 0, 10),
            ("variety", self.variety, 0, 10),
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


def _direction_text(direction: Any) -> Any:
    """Return a direction as text if it is a number of degrees or three numbers; others unchanged."""
    if isinstance(direction, str) or direction is None or callable(direction):
        return direction
    if isinstance(direction, Mapping):
        return {str(name): str(_direction_text(one)) for name, one in direction.items()}
    parts = [direction] if isinstance(direction, Real) else members(direction) or []
    if len(parts) not in (1, 3) or not all(isinstance(part, Real) for part in parts):
        raise InputError(
            f"direction is {on_a_line(direction)}; allowed: {', '.join(_DIRECTIONS)}, degrees, a vector as "
            "(x, y, z) or 'x,y,z', 'around:z', or a function"
        )
    return ",".join(repr(float(part)).removesuffix(".0") for part in parts)


def check_owner(method: str, asked: "Sequence[Field[Any]]") -> None:
    """Raise InputError if an option belongs to other methods only."""
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
