"""Lengths: what people write, in the model's units."""

import math

import pytest

from upholster.base.errors import InputError
from upholster.base.lengths import METRES, parse_length, read_length


@pytest.mark.parametrize(
    ("text", "metres_per_unit", "expected"),
    [
        ("30cm", 1.0, 0.3),
        ("0.6 mm", 0.001, 0.6),
        ("0.6mm", 1.0, 0.0006),
        ("12in", 0.3048, 1.0),
        ("1ft", 0.0254, 12.0),
        ("2", None, 2.0),
        ("2", 0.001, 2.0),
        (" .5M ", 0.01, 50.0),
        ("-1e-3m", 0.001, -1.0),
        ("1.", None, 1.0),
        (0.25, 0.001, 0.25),
        (3, None, 3.0),
    ],
)
def test_a_length_is_in_model_units(
    text: str | float, metres_per_unit: float | None, expected: float
) -> None:
    assert parse_length(text, metres_per_unit) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("unit", METRES)
def test_each_unit_is_itself_in_a_model_of_that_unit(unit: str) -> None:
    assert parse_length(f"7.5{unit}", METRES[unit]) == pytest.approx(7.5, rel=1e-12)
    assert read_length(f"7.5 {unit}").unit == unit


@pytest.mark.parametrize(
    "text",
    ["", "mm", "30 lm", "30cm2", "3,5cm", "30  cm", "nan", "inf", "0x10", "1e999", math.inf, True, "ⅷ", "٣"],
)
def test_what_is_no_length_is_refused_in_one_line(text: str | float) -> None:
    with pytest.raises(InputError, match=r"^size is .*; allowed: .*30cm$"):
        parse_length(text, 1.0, name="size")


def test_a_unit_needs_a_model_that_knows_its_own() -> None:
    with pytest.raises(InputError, match=r"^size is '30cm', and this model .* as 30; or .* --unit mm$"):
        parse_length("30cm", None, name="size")
