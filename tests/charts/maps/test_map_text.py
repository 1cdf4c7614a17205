"""Maps as users write them: what is read, and what is refused."""

import pytest

from upholster.base.errors import InputError
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.shapes import Part
from upholster.charts.maps.surface_map import Least

WELL = (
    "mask.png",
    "folder/Mask.EXR",
    "part:Leg*",
    "colors",
    "height",
    "Height",
    "slope",
    "facing:z",
    "Facing:-Z",
    "facing:1,0,-2.5",
    "0,0,1:0.5",
    "-1,.5,1e-3 : 30cm",
    "curvature",
    "Curvature:30cm",
    "occlusion",
    "occlusion:0.5",
    "noise",
    "noise: 2 in",
    "strokes.json",
    "some/Strokes.JSON",
)


@pytest.mark.parametrize("text", WELL)
def test_maps_are_read_alone_inverted_and_compared(text: str) -> None:
    plain = parse_map(f" {text} ")
    assert plain.text == text
    for prefix, suffix, above, below in (
        ("1-", "", None, None),
        ("", ">0.5", 0.5, None),
        ("1- ", " < 1", None, 1),
    ):
        other = parse_map(prefix + text + suffix)
        assert (other.source, other.above, other.below) == (plain.source, above, below)
        assert other.is_inverted == bool(prefix)
        assert other.files == plain.files
    assert parse_map(text) == plain


def test_maps_joined_by_and_are_several() -> None:
    texts = ("1-a.png>0.3", "part:Leg*", "facing:z", "aa.png")
    joined = parse_map("  and ".join(texts))
    assert joined.source == Least(tuple(map(parse_map, texts)))
    assert joined.files == ("a.png", "aa.png")
    assert joined.named(lambda file: f"x/{file}") == "1-x/a.png>0.3 and part:Leg* and facing:z and x/aa.png"
    # Names may contain the word.
    for text in ("salt and pepper.png", "part:Salt and Pepper"):
        assert not isinstance(parse_map(text).source, Least)
    assert parse_map("part:Salt and Pepper").source == Part("Salt and Pepper")


def test_files_are_reported() -> None:
    assert parse_map("1-a/mask.png>0.3").files == ("a/mask.png",)
    assert parse_map("./1-mask.png").files == ("./1-mask.png",)
    assert parse_map("height").files == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "map is ''; allowed: an image's file"),
        ("heigth", "map is 'heigth'; allowed"),
        ("height:3", "map is 'height:3'"),
        ("mask.txt", "map is 'mask.txt'"),
        ("facing", "map is 'facing'"),
        ("facing:w", "allowed: facing: and x, y, z"),
        ("facing:0,0,0", "a finite vector that is not zero"),
        ("facing:0,0,1e999", "a finite vector that is not zero"),
        ("part:", "names no part"),
        ("height>1.5", "compares with 1.5; allowed: 0 to 1"),
        ("height>-0.1", "compares with -0.1; allowed: 0 to 1"),
        ("height>half", "map is 'height>half'"),
        ("curvature:-1", "reach of map 'curvature:-1' is -1; allowed: a length above 0"),
        ("noise:", "blobs of map 'noise:' is ''"),
        ("occlusion:5lightyears", "reach of map 'occlusion:5lightyears' is '5lightyears'"),
        ("0,0,0:0", "is 0; allowed: a length above 0"),
        ("0,0,0:-1cm", "is -1cm; allowed: a length above 0"),
        ("0,0,0:wide", "radius of map '0,0,0:wide' is 'wide'"),
        ("0,0,1e300:1", "beyond ±1e18"),
        ("x" * 5000, "has 5000 characters; allowed: 4096"),
        (3, "map is a int; allowed"),
        ("height and slop>0.5", "map is 'slop>0.5'; allowed"),
        ("height or slope", "map is 'height or slope'; allowed"),
        ("height and", "map is 'height and'; allowed"),
        ("height and and slope", "map is 'and slope'; allowed"),
    ],
)
def test_what_is_no_map_is_refused_in_one_line(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_map(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
