"""Lengths as users write them: ``30cm``, ``0.6 mm``, ``12in``, or a plain number of the model's units."""

import math
import re
from dataclasses import dataclass

from upholster.base.errors import InputError

__all__ = ["METRES", "Length", "parse_length", "read_length"]

METRES = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""Units by name, in metres: of lengths, and of models whose files state none."""

_FORM = re.compile(r"([+-]?(?:[0-9]{1,18}(?:\.[0-9]{0,18})?|\.[0-9]{1,18})(?:e[+-]?[0-9]{1,2})?) ?([a-z]*)")


@dataclass(frozen=True, slots=True)
class Length:
    """A length as written, for a model whose unit may not be known yet.

    Attributes
    ----------
    text
        As the user wrote it.
    number
        Its number: finite.
    unit
        One of `METRES`; empty for the model's own.
    """

    text: str
    number: float
    unit: str

    def in_units(self, metres_per_unit: float | None, *, name: str = "length") -> float:
        """Return the length in model units.

        Parameters
        ----------
        metres_per_unit
            Length of a model unit in metres; None if it is not known.
        name
            The value's name in messages.

        Raises
        ------
        InputError
            If the length has a unit, and the model's is not known.
        """
        if not self.unit:
            return self.number
        if metres_per_unit is None:
            raise InputError(
                f"{name} is {self.text!r}, and this model does not state the length of its unit; "
                f"allowed: a number of model units, as {self.number:g}; or a model's file with --unit mm"
            )
        return self.number * METRES[self.unit] / metres_per_unit


def read_length(text: str | float, *, name: str = "length") -> Length:
    """Read a length: a number, and a unit right after it or after a space. Capitals count as small letters.

    Parameters
    ----------
    text
        As ``"30cm"`` or ``"0.6 mm"``; or a number of model units.
    name
        The value's name in messages.

    Raises
    ------
    InputError
        If it is not a number, or the unit is unknown.
    """
    found = _FORM.fullmatch(text.strip().lower()) if isinstance(text, str) else None
    if found is not None and (not found[2] or found[2] in METRES):
        length = Length(text.strip() if isinstance(text, str) else "", float(found[1]), found[2])
    elif isinstance(text, (int, float)) and not isinstance(text, bool):
        length = Length(f"{text:g}", float(text), "")
    else:
        length = Length("", math.nan, "")
    if not math.isfinite(length.number):
        raise InputError(
            f"{name} is {text!r}; allowed: a number of model units, or one with a unit "
            f"({', '.join(METRES)}), as 30cm"
        )
    return length


def parse_length(text: str | float, metres_per_unit: float | None, *, name: str = "length") -> float:
    """Read a length, and return it in model units: `read_length` and `Length.in_units`."""
    return read_length(text, name=name).in_units(metres_per_unit, name=name)
