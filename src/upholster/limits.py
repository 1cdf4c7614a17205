"""What a file may ask of a decoder at most: set by the caller, within what the formats allow (SPEC.md, 9)."""

from dataclasses import dataclass, fields

from upholster.errors import check_whole

__all__ = ["Limits"]

_MOST = {"texels": 2**31, "samples": 12_800_000, "charts": 2**18, "triangles": 2**20}
_LEAST = {"samples": 2**16, "charts": 2**12, "triangles": 2**12}
_TEXELS_EACH = {"samples": 1, "charts": 256, "triangles": 8}


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one decoder. What is not told goes with the texels.

    Attributes
    ----------
    texels
        Of all charts together, 1 to 2^31: 2^28 by default, a square of 16384.
    samples
        Height × width × channels, of all maps of the exemplar together: one a texel, 65,536 at least,
        12.8 million at most.
    charts
        One for 256 texels, 4096 at least, 262,144 at most.
    triangles
        Of a mesh: one for 8 texels, 4096 at least, 1,048,576 at most.

    Raises
    ------
    InputError
        If one is not a whole number from 1 to what the format allows.
    """

    texels: int = 2**28
    samples: int | None = None
    charts: int | None = None
    triangles: int | None = None

    def __post_init__(self) -> None:
        check_whole("limit of texels", self.texels, 1, _MOST["texels"])
        for field in fields(self):
            name, given = field.name, getattr(self, field.name)
            if given is None:
                value = min(_MOST[name], max(_LEAST[name], self.texels // _TEXELS_EACH[name]))
            else:
                value = check_whole(f"limit of {name}", given, 1, _MOST[name])
            object.__setattr__(self, name, value)

    def of(self, name: str) -> int:
        """Return a limit by its name: never None, whatever was told."""
        value = getattr(self, name)
        assert isinstance(value, int)
        return value
