"""Options of outputs: models, pictures and streams."""

from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any, Literal, cast, get_args

from upholster.base.conditions import read_conditions
from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.formats import OUTPUTS, suffixes_of
from upholster.base.lengths import read_length
from upholster.base.options.option_fields import about, convert_types, differing, documented

__all__ = ["QUALITY", "RELIEF", "Quality", "TextureFormat", "WriteOptions", "check_quality"]

DISPLACED_BY = ("height", "luminance")

TextureFormat = Literal["auto", "png", "jpeg", "webp"]

QUALITY = 46.0
"""PSNR in dB at which a sample's stream ends by default: no loss is visible above it (docs/decisions.md)."""

Quality = float | Literal["lossless"]

RELIEF = ("displace", "displace_by", "mid_level", "keep", "triangles")
"""Options of a relief in the mesh; all others need the first."""

_OUTPUT, _STREAM = "Output", "Stream"


def check_quality(sample_quality: object) -> None:
    """Raise InputError for a quality that is neither 20 to 80 dB, nor "lossless", nor None."""
    if sample_quality is None or (isinstance(sample_quality, str) and sample_quality == "lossless"):
        return
    number = isinstance(sample_quality, Real) and not isinstance(sample_quality, bool)
    if not number or not 20 <= float(cast(float, sample_quality)) <= 80:
        raise InputError(
            f"sample_quality is {on_a_line(sample_quality)}; allowed: 20 to 80 (dB), or lossless"
        )


@documented
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
        metadata=about(_OUTPUT, "Quadrilaterals of the whole surface's mesh, 1 to 10,000,000."),
    )
    texture: TextureFormat = field(
        default="auto",
        metadata=about(
            _OUTPUT,
            "Format of the textures in a GLB: png, jpeg, webp (smallest); auto: colours without alpha jpeg, "
            "all else png.",
        ),
    )
    quality: int = field(default=90, metadata=about(_OUTPUT, "Quality of JPEG and WebP, 1 to 100."))
    normal_scale: float = field(
        default=1.0,
        metadata=about(_OUTPUT, "Strength of a material's normal map in a GLB or picture, 0 to 100."),
    )
    padding: int | None = field(
        default=None,
        metadata=about(
            _OUTPUT,
            "Texels around each chart in an atlas, continued from its neighbours; on a mesh, texels between "
            "two islands: 0 to 64. Default: 16; on a mesh 4, 8 or 16, by its texels.",
            metavar="N",
        ),
    )
    atlas_size: int | None = field(
        default=None,
        metadata=about(
            _OUTPUT,
            "Height and width of every page of an atlas in texels: 256, 512 ... 8192. Default: pages as "
            "large as their charts need, 8192x8192 at most unless a single chart is larger.",
            metavar="N",
        ),
    )
    pot: bool = field(
        default=False,
        metadata=about(_OUTPUT, "Make the sides of pages powers of two, as some engines require."),
    )
    lods: int = field(
        default=1,
        metadata=about(
            _OUTPUT,
            "Number of files for each GLB, 1 to 8: `x.glb`, then `x_lod1.glb` with half the texels each way, "
            "`x_lod2.glb` with a quarter ...",
        ),
    )
    size: tuple[int, int] = field(
        default=(1024, 768),
        metadata=about(_OUTPUT, "Width and height of a picture in pixels.", metavar="WxH"),
    )
    view: tuple[float, float] = field(
        default=(30.0, 30.0),
        metadata=about(_OUTPUT, "Azimuth and elevation of a picture in degrees.", metavar="AZ,EL"),
    )
    supersample: int = field(default=2, metadata=about(_OUTPUT, "Rays per pixel each way, 1 to 8."))
    displace: str | float | None = field(
        default=None,
        metadata=about(
            _OUTPUT,
            f"In {' '.join(suffixes_of(kind for kind in OUTPUTS if kind.solid))} move the surface outward by "
            "the height map. This is the distance where the height is 1: `0.6mm`, or in model units; below 0 "
            "moves inward.",
            metavar="LENGTH",
        ),
    )
    displace_by: str = field(
        default="height",
        metadata=about(
            _OUTPUT,
            "Displace by the height map, or by luminance if the sample has no height map.",
            metavar="height|luminance",
        ),
    )
    mid_level: float = field(
        default=0.0,
        metadata=about(_OUTPUT, "The height that does not move, 0 to 1; lower ones move the other way."),
    )
    keep: str | None = field(
        default=None,
        metadata=about(
            _OUTPUT,
            "Where nothing moves, such as a base that stays flat: `z<0.1mm`, `x>=0 and z<2`.",
            metavar="CONDITIONS",
        ),
    )
    triangles: int = field(
        default=500_000,
        metadata=about(
            _OUTPUT,
            "Largest number of triangles of the displaced mesh, 1000 to 8,000,000: `2M`. Fewer are used if "
            "they suffice for the height map.",
            metavar="N",
        ),
    )
    wavelet: str | None = field(
        default=None,
        metadata=about(
            _STREAM,
            "Wavelet that codes the sample: 9/7, 5/3 or haar (the paper's: the largest coefficients first). "
            "Default: haar with method paper; else 9/7, or 5/3 if the sample is kept lossless.",
        ),
    )
    wavelet_levels: int | None = field(
        default=None,
        metadata=about(
            _STREAM,
            "Levels of that transform, 0 to 10. Default: three with haar, as in the paper; else by the "
            "sample's size.",
        ),
    )
    sample_quality: float | str = field(
        default=QUALITY,
        metadata=about(
            _STREAM,
            "Quality at which the sample's stream ends: its PSNR in dB, 20 to 80, or `lossless`. No loss is "
            "visible above the default.",
            metavar="DB",
        ),
    )
    stream_bytes: int | None = field(
        default=None,
        metadata=about(_STREAM, "Largest length in bytes: `8k`; 256 or more.", metavar="N", flag="--bytes"),
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
        """Arguments of `upholster.model.islands.pack_atlas`, which lay out the pages of an atlas."""
        return {"gutter": self.padding, "size": self.atlas_size, "powers": self.pot}

    @property
    def transform(self) -> dict[str, Any]:
        """Arguments of `upholster.encode_stream`, which set how a stream transforms the sample."""
        return {"wavelet": self.wavelet, "levels": self.wavelet_levels, "sample_quality": self.sample_quality}

    def __repr__(self) -> str:
        return on_a_line(self, differing(self))

    def __post_init__(self) -> None:
        convert_types(self)
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
            for name in RELIEF[1:]:
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
