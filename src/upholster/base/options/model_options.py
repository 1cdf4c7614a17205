"""Options of a model: how its file is read."""

from dataclasses import dataclass, field

from upholster.base.errors import InputError
from upholster.base.lengths import METRES
from upholster.base.options.option_fields import about, convert_types, documented

__all__ = ["ModelOptions"]

_MODEL = "Model"


@documented
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
        metadata=about(
            _MODEL,
            "Cover only these parts, by the name of part, object or material: `Seat`, `'Leg*'`; `'sink#2'` "
            "is the second sink; repeatable. `upholster info` lists them. Default: all.",
            metavar="NAME",
        ),
    )
    uv: str = field(
        default="new",
        metadata=about(
            _MODEL,
            "keep: charts cut as the model's own texture coordinates are cut, which may not overlap, and "
            "packed again; new: charts that we make.",
            metavar="new|keep",
        ),
    )
    unit: str | None = field(
        default=None,
        metadata=about(
            _MODEL,
            f"The file's unit, if the file does not state it: {', '.join(METRES)}. In glTF, which is "
            "in metres, another unit changes only how lengths such as `30cm` are read.",
            metavar="UNIT",
        ),
    )
    up: str | None = field(
        default=None,
        metadata=about(
            _MODEL, "Which axis is up in the file; default: y in GLB, glTF and OBJ, else z.", metavar="y|z"
        ),
    )
    deviation: str | None = field(
        default=None,
        metadata=about(
            _MODEL,
            "Largest distance of triangles from the faces of a CAD model: `0.1mm`. Default: a two-thousandth "
            "of its size.",
            metavar="LENGTH",
        ),
    )
    unique: bool = field(
        default=False,
        metadata=about(
            _MODEL,
            "If a shape of a CAD model is in several places, cover each place separately. Default: cover it "
            "once and show it in all.",
        ),
    )

    def __post_init__(self) -> None:
        convert_types(self)
        if self.uv not in ("new", "keep"):
            raise InputError(f"uv is {self.uv!r}; allowed: new, keep")
