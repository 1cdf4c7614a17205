"""The words for directions: a row for each, which help, messages, parsing and the studio's list read."""

from dataclasses import dataclass
from typing import Literal

__all__ = ["AXIS_DIRECTIONS", "DIRECTIONS", "FIELD_DIRECTIONS", "PATCH_DIRECTIONS", "DirectionWord"]


@dataclass(frozen=True, slots=True)
class DirectionWord:
    """A word for a direction.

    Attributes
    ----------
    word
        As users write it. For a word of all surfaces, also the key of its function in
        `upholster.charts.directions.direction_request`.
    of
        The surfaces that have it: "all", "patches", or faces with "axes", of CAD models.
    label
        Its name in the studio.
    meaning
        Its meaning for the help, in brackets after the word; empty: the help has a sentence of its own.
    """

    word: str
    of: Literal["all", "patches", "axes"]
    label: str
    meaning: str = ""


DIRECTIONS = (
    DirectionWord("level", "all", "level, as bricks in a wall", "along lines of equal z"),
    DirectionWord("smooth", "all", "with few turns", "with few turns"),
    DirectionWord("curvature", "all", "along the greatest bend", "the way of the greatest bend"),
    DirectionWord("edges", "all", "along sharp edges", "along and across sharp ones"),
    DirectionWord("u", "patches", "along u of patches"),
    DirectionWord("v", "patches", "along v of patches"),
    DirectionWord("along", "axes", "along axes (CAD)"),
    DirectionWord("around", "axes", "around axes (CAD)"),
)
"""All words, in the order of the help."""


def _words(of: str) -> tuple[str, ...]:
    return tuple(row.word for row in DIRECTIONS if row.of == of)


FIELD_DIRECTIONS = _words("all")
PATCH_DIRECTIONS = _words("patches")
AXIS_DIRECTIONS = _words("axes")
