"""Conditions on coordinates."""

import pytest

from upholster.base.conditions import read_conditions
from upholster.base.errors import InputError


def test_conditions_are_bounds() -> None:
    found = read_conditions(" z<0.1mm and X >= -2  and y>3 in")
    assert [(c.axis, c.below, c.bound.number, c.bound.unit) for c in found] == [
        (2, True, 0.1, "mm"),
        (0, False, -2.0, ""),
        (1, False, 3.0, "in"),
    ]


@pytest.mark.parametrize(
    "text", ["", "z", "w<1", "z=1", "z<", "z<1 or x<2", "z<1 and", "0<z", "z<1 x<2", "z<<1"]
)
def test_anything_else_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(InputError, match=r"^keep.* allowed: "):
        read_conditions(text)
