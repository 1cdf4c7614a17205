"""Options of a sample: how a photo is prepared and a material's maps are found."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from os import PathLike, fspath
from typing import Any

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.options.option_fields import about, documented

__all__ = ["PREPARING", "SampleOptions"]

_SAMPLE, _MAPS = "Sample", "Maps"


@documented
@dataclass(frozen=True, slots=True, kw_only=True)
class SampleOptions:
    """How a sample is read: its maps, and how a photo is prepared (all maps of a material alike).

    The allowed values depend on the photo, and are checked when it is read.
    """

    rectify: (
        tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]] | None
    ) = field(
        default=None,
        metadata=about(
            _SAMPLE,
            "Four corners of a rectangle on the wall, in pixels of the photo: top left, top right, bottom "
            "right, bottom left. The sample is this rectangle, seen from the front.",
            metavar="X,Y X,Y X,Y X,Y",
        ),
    )
    crop: tuple[int, int, int, int] | None = field(
        default=None, metadata=about(_SAMPLE, "Use this part, in pixels.", metavar="X,Y,W,H")
    )
    resize: int | str | tuple[int, int] | None = field(
        default=None, metadata=about(_SAMPLE, "Resize to this longer side, or size.", metavar="N|WxH")
    )
    even_light: bool = field(
        default=False,
        metadata=about(
            _SAMPLE,
            "Remove vignetting and slow shading: variations over half the sample or more.",
        ),
    )
    use: str | None = field(
        default=None,
        metadata=about(
            _SAMPLE,
            "Use only pixels that this image, of the photo's size, shows white: no window, no finger. Or "
            "`alpha`: pixels that the photo's own alpha shows; it then is no transparency. Method quilt.",
            metavar="MASK",
        ),
    )
    maps: dict[str, str] | None = field(
        default=None,
        metadata=about(
            _MAPS,
            "A map of the material whose name does not show its role: `roughness=x.png`, `orm=y.jpg` …",
            metavar="ROLE=FILE",
            flag="--map",
        ),
    )
    normal: str | None = field(
        default=None,
        metadata=about(
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
        """Arguments of `upholster.read_exemplar`, which set how a photo is prepared."""
        return {name: getattr(self, name) for name in PREPARING}

    @property
    def of_guides(self) -> "SampleOptions":
        """The options as images of guides follow them: all but those that change colours."""
        return replace(self, even_light=False)

    def renamed(self, name: Callable[[str], str]) -> "SampleOptions":
        """Return the options with other names of files; `name` returns a file's."""
        maps = self.maps and {role: name(file) for role, file in self.maps.items()}
        return replace(self, maps=maps, use=self.use if self.mask is None else name(self.mask))


_OF_MATERIALS = ("use", "maps", "normal")

PREPARING = tuple(entry.name for entry in fields(SampleOptions) if entry.name not in _OF_MATERIALS)
"""Options of every photo: the others name further files, or concern a material's other maps."""
