"""Pairs as users write them: what to lay, and where. ``SAMPLE=TARGET@weight`` and ``FILE@size=TARGET``."""

import re
from dataclasses import dataclass

from upholster.base.errors import InputError

__all__ = [
    "AgainText",
    "GuideText",
    "PutText",
    "ZoneText",
    "parse_again",
    "parse_guide",
    "parse_put",
    "parse_zone",
]

_MOST_WEIGHT = 100.0

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


@dataclass(frozen=True, slots=True)
class GuideText:
    """A guide: ``SAMPLE=TARGET@weight``.

    Attributes
    ----------
    sample
        The map of the sample: an image's file, or a word for one of the sample's own maps.
    target
        The map of the surface, as `upholster.charts.maps.map_text.parse_map` reads it.
    weight
        Its weight, above 0.
    """

    sample: str
    target: str
    weight: float = 1.0

    def __str__(self) -> str:
        # The text after the last @ is read as the weight: a target with an @ needs one.
        plain = self.weight == 1 and "@" not in self.target
        return f"{self.sample}={self.target}" + ("" if plain else f"@{self.weight!r}".removesuffix(".0"))


@dataclass(frozen=True, slots=True)
class ZoneText:
    """A zone: ``FILE@size=TARGET``.

    Attributes
    ----------
    sample
        A file or folder, optionally with its width after an @.
    target
        As for `GuideText`: the zone is where it is white.
    """

    sample: str
    target: str

    def __str__(self) -> str:
        return f"{self.sample}={self.target}"


@dataclass(frozen=True, slots=True)
class AgainText:
    """A region that is laid again: ``REGION@seed``.

    Attributes
    ----------
    region
        As for `GuideText.target`.
    seed
        The seed; None: from the number of earlier regions.
    """

    region: str
    seed: int | None = None

    def __str__(self) -> str:
        return self.region if self.seed is None else f"{self.region}@{self.seed}"


def parse_guide(text: str, what: str = "guide") -> GuideText:
    """Read a guide: split at the first ``=`` and the last ``@``.

    Raises
    ------
    InputError
        If it is not a guide, or its weight is not above 0 and at most 100.
    """
    sample, equals, rest = text.partition("=")
    target, at, written = rest.rpartition("@")
    if not at or re.search(r"\.[a-zA-Z]", written):  # a file may have an @ in its name
        target, written = rest, ""
    if not (equals and sample.strip() and target.strip()):
        raise InputError(f"{what} is {text[:80]!r}; allowed: SAMPLE=TARGET or SAMPLE=TARGET@weight")
    try:
        weight = float(written) if written else 1.0
    except ValueError:
        weight = -1.0
    if not 0 < weight <= _MOST_WEIGHT:
        raise InputError(
            f"weight of {what} {text[:80]!r} is {written[:20]!r}; allowed: above 0, at most {_MOST_WEIGHT:g}"
        )
    return GuideText(sample.strip(), target.strip(), weight)


def parse_again(text: str) -> AgainText:
    """Read a region that is laid again: ``REGION`` or ``REGION@seed``.

    Raises
    ------
    InputError
        If it is not a region, or its seed is not a whole number from 0 to 2^63 − 1.
    """
    region, at, seed = text.rpartition("@")
    if not at or re.search(r"\.[a-zA-Z]", seed):
        return AgainText(_region(text))
    if not (seed.isascii() and seed.isdecimal() and int(seed) < 2**63):
        raise InputError(f"seed of again {text[:80]!r} is {seed[:20]!r}; allowed: 0 to 2^63 - 1")
    return AgainText(_region(region), int(seed))


def _region(text: str) -> str:
    if not text.strip():
        raise InputError("again is empty; allowed: REGION or REGION@seed, as 0,0,1:0.3")
    return text.strip()


@dataclass(frozen=True, slots=True)
class PutText:
    """A piece of a sample at a chosen position: ``PIECE=X,Y,Z*size@degrees``.

    Attributes
    ----------
    piece
        A file, optionally with its width after an @; or x, y, width and height in pixels of the sample.
    place
        In model units; on a flat texture (x, y) in pixels.
    size
        Its scale relative to the sample.
    degrees
        The angle by which it is turned, clockwise seen from outside.
    """

    piece: str | tuple[int, int, int, int]
    place: tuple[float, ...]
    size: float = 1.0
    degrees: float = 0.0

    def __str__(self) -> str:
        piece = self.piece if isinstance(self.piece, str) else ",".join(map(str, self.piece))
        size = "" if self.size == 1 else f"*{self.size!r}"
        degrees = "" if self.degrees == 0 else f"@{self.degrees!r}"
        return f"{piece}={','.join(map(repr, self.place))}{size}{degrees}"


_PLACE = re.compile(rf"({_NUMBER}),({_NUMBER})(?:,({_NUMBER}))?(?:\*({_NUMBER}))?(?:@({_NUMBER}))?")

_PIECE = re.compile(r"(\d{1,5}),(\d{1,5}),(\d{1,5}),(\d{1,5})")


def parse_put(text: str) -> PutText:
    """Read a piece at a chosen position: split at the last ``=``.

    Raises
    ------
    InputError
        If it is not a piece, a coordinate is beyond ±1e18, its size is not 1/16 to 16, or its turn beyond
        ±36,000 degrees.
    """
    piece, equals, rest = text.rpartition("=")
    found = _PLACE.fullmatch(rest.strip())
    if not (equals and piece.strip() and found):
        raise InputError(
            f"put is {text[:80]!r}; allowed: FILE=X,Y,Z, FILE@width=X,Y,Z or X,Y,W,H=X,Y,Z, then "
            "*size and @degrees"
        )
    place = tuple(float(number) for number in found.group(1, 2, 3) if number)
    size, degrees = float(found[4] or 1.0), float(found[5] or 0.0)
    if not all(abs(number) <= 1e18 for number in place):
        raise InputError(f"put {text[:80]!r} has a coordinate beyond ±1e18; allowed: less")
    if not 1 / 16 <= size <= 16:
        raise InputError(f"size of put {text[:80]!r} is {size:g}; allowed: 1/16 to 16")
    if not abs(degrees) <= 36_000:
        raise InputError(f"turn of put {text[:80]!r} is {degrees:g} degrees; allowed: -36000 to 36000")
    part = _PIECE.fullmatch(piece.strip())
    if part is None:
        return PutText(piece.strip(), place, size, degrees)
    x, y, width, height = map(int, part.groups())
    return PutText((x, y, width, height), place, size, degrees)


def parse_zone(text: str) -> ZoneText:
    """Read a zone: split at the first ``=``.

    Raises
    ------
    InputError
        If it is not a zone.
    """
    sample, equals, target = text.partition("=")
    if not (equals and sample.strip() and target.strip()):
        raise InputError(f"zone is {text[:80]!r}; allowed: SAMPLE=TARGET, SAMPLE a file or FILE@width")
    return ZoneText(sample.strip(), target.strip())
