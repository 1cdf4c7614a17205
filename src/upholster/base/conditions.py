"""Conditions on coordinates as users write them: ``z<0.1mm``, ``x>=0 and z<2``."""

import re
from dataclasses import dataclass

from upholster.base.errors import InputError
from upholster.base.lengths import Length, read_length

__all__ = ["Condition", "read_conditions"]

_FORM = re.compile(r"\s*([xyzXYZ])\s*(<=|>=|<|>)\s*(\S.*?)\s*")


@dataclass(frozen=True, slots=True)
class Condition:
    """One bound of a coordinate.

    Attributes
    ----------
    axis
        0, 1, 2: x, y, z.
    below
        Whether the condition holds below the bound, otherwise above it. At the bound it holds.
    bound
        In the model's units, or with a unit.
    """

    axis: int
    below: bool
    bound: Length


def read_conditions(text: str, *, name: str = "keep") -> tuple[Condition, ...]:
    """Read conditions that hold together: each an axis, a sign and a length; joined by ``and``.

    Signs are ``<``, ``<=``, ``>``, ``>=``; ``<`` and ``<=`` mean the same, likewise ``>`` and ``>=``.

    Parameters
    ----------
    text
        As ``"z<0.1mm"`` or ``"x>=0 and z<2"``.
    name
        The value's name in messages.

    Raises
    ------
    InputError
        If it has another form.
    """
    found = []
    for part in re.split(r"\s+and\s+", text.strip()):
        match = _FORM.fullmatch(part)
        if match is None:
            raise InputError(
                f"{name} is {text!r}; allowed: conditions on x, y or z with <, <=, > or >=, joined by and, "
                "as 'z<0.1mm' or 'x>=0 and z<2'"
            )
        bound = read_length(match[3], name=f"{name}'s bound")
        found.append(Condition("xyz".index(match[1].lower()), match[2][0] == "<", bound))
    return tuple(found)
