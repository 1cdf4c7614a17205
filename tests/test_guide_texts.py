"""Texts of guides, zones, regions and pieces: what is written is read again."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from upholster import InputError
from upholster.base.guide_texts import (
    AgainText,
    GuideText,
    PutText,
    ZoneText,
    parse_again,
    parse_guide,
    parse_put,
    parse_zone,
)

FILES = st.sampled_from(["a.png", "dir/b c.jpg", "x@2.png", "luminance", "../é.webp"])
MAPS = st.sampled_from(["height", "1-slope>0.5", "facing:0,1,1", "0,0,1:0.3", "mask@2.png", "part:Seat"])
NUMBERS = st.floats(-1e6, 1e6)


@given(FILES, MAPS | st.just("mask@2"), st.just(1.0) | st.floats(0, 100, exclude_min=True))
def test_guides(sample: str, target: str, weight: float) -> None:
    found = parse_guide(str(GuideText(sample, target, weight)))
    assert found == GuideText(sample, target, weight)


@given(st.sampled_from(["a.png", "a.png@30cm", "folder", "x@2.png"]), MAPS)
def test_zones(sample: str, target: str) -> None:
    assert parse_zone(str(ZoneText(sample, target))) == ZoneText(sample, target)


@given(MAPS, st.none() | st.integers(0, 2**63 - 1))
def test_regions(region: str, seed: int | None) -> None:
    assert parse_again(str(AgainText(region, seed))) == AgainText(region, seed)


@given(
    st.sampled_from(["sign.png", "sign.png@20cm", (1, 2, 30, 40)]),
    st.tuples(NUMBERS, NUMBERS) | st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.floats(1 / 16, 16),
    st.floats(-36_000, 36_000),
)
def test_pieces(
    piece: str | tuple[int, int, int, int], place: tuple[float, ...], size: float, degrees: float
) -> None:
    assert parse_put(str(PutText(piece, place, size, degrees))) == PutText(piece, place, size, degrees)


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (parse_guide, "x"), (parse_guide, "=height"), (parse_guide, "a.png="), (parse_guide, "a=b@-1"),
        (parse_guide, "a=b@1e9"), (parse_guide, "a=b@x"), (parse_zone, "a"), (parse_zone, "=a"),
        (parse_again, ""), (parse_again, "@3"), (parse_again, "a@-3"), (parse_again, f"a@{2**63}"),
        (parse_put, "a"), (parse_put, "a=1"), (parse_put, "a=1,2,3*0"), (parse_put, "a=1,2,3*17"),
        (parse_put, "a=1,2,1e19"), (parse_put, "a=1,2,3@99999"), (parse_put, "=1,2,3"),
        (parse_put, "a=1,2,nan"),
    ],
)  # fmt: skip
def test_what_is_none_of_them_is_refused(read: object, text: str) -> None:
    with pytest.raises(InputError, match="allowed") as reported:
        read(text)  # type: ignore[operator]
    assert len(str(reported.value).splitlines()) == 1
