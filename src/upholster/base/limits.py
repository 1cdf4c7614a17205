"""Limits of a file's demands on a decoder: set by the caller, within those of the formats (SPEC.md, 9)."""

from dataclasses import dataclass, fields

from upholster.base.errors import FormatError, check_whole

__all__ = ["Limits"]

_MOST = {"texels": 2**31, "samples": 12_800_000, "charts": 2**18, "triangles": 2**20}
_LEAST = {"samples": 2**16, "charts": 2**12, "triangles": 2**12}
_TEXELS_EACH = {"samples": 1, "charts": 256, "triangles": 8}


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one decoder. A limit that is not given follows from the texels.

    Attributes
    ----------
    texels
        Texels of all charts together, 1 to 2^31: 2^28 by default, a square of 16384. Label maps may have as
        many cells, or 65,536 if that is more.
    samples
        Height × width × channels, of all maps of the exemplar together: one per texel, at least 65,536, at
        most 12.8 million.
    charts
        One per 256 texels, at least 4096, at most 262,144.
    triangles
        Triangles of a mesh: one per 8 texels, at least 4096, at most 1,048,576.

    Raises
    ------
    InputError
        If a limit is not a whole number from 1 to the format's own limit.
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

    def check(self, what: str, name: str, count: int) -> None:
        """Raise FormatError if a file demands more than a limit; arguments as for `refusal`."""
        if refused := self.refusal(what, name, count):
            raise FormatError(refused)

    def refusal(self, what: str, name: str, count: int) -> str:
        """Return why a demand is refused, and the limit that would allow it; empty if it is allowed.

        Parameters
        ----------
        what
            What demands it, as "layout has".
        name, count
            The limit's name, and the number demanded.
        """
        most = self.of(name)
        if count <= most:
            return ""
        cure = "" if count > _MOST[name] else f"; --limit {count * _TEXELS_EACH.get(name, 1)} allows it"
        return f"{what} {count} {name}; allowed here: {most}{cure}"

    def of(self, name: str) -> int:
        """Return a limit by its name: never None, even if it was not given."""
        value = getattr(self, name)
        assert isinstance(value, int)
        return value
