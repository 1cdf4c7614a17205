"""Streams that ask for what no decoder may give: frozen ones, refused by the number that is wrong."""

from pathlib import Path

import numpy as np
import pytest

from upholster import Limits
from upholster.base.errors import FormatError, InputError
from upholster.codec.ezw import decode, encode
from upholster.codec.stream.reader import StreamDecoder, read_stream

REFUSED = Path(__file__).parents[1] / "vectors" / "refused"

WHY = {
    "range_beyond": "allowed: rising, within ±65504",
    "normal_of_one_channel": "map 'normal' has 1 channels; allowed: 3",
    "placements_beyond": "number of placements is 101; allowed: 1 to 100",
    "cells_beyond": "label maps have 6012 cells; allowed: 4032",
    "density_beyond": "density 2.0 makes 1,073,741,824 texels, 32,768 along a side",
    "base_of_too_many_pixels": "a step of the base has 7.84314e+27 pixels; allowed: at most 2^24",
    "base_after_a_surface": "chunk 'B' comes after 'S', or after 4 others",
    "tones_after_placements": "chunk 't' comes after 'P'",
    "tones_of_two_layers": "chunk 't': tones with two layers; allowed: with one",
    "bases_5": "chunk 'B' comes after 'S', or after 4 others",
    "chunks_4097": "chunk 4097; allowed: 4096 in a file",
}


def test_all_frozen_ones_are_known() -> None:
    assert {path.stem for path in REFUSED.glob("*.uph")} == set(WHY)


@pytest.mark.parametrize("name", WHY)
def test_what_is_wrong_is_named_however_the_bytes_come(name: str) -> None:
    data = (REFUSED / f"{name}.uph").read_bytes()
    for piece in (len(data), 1000):
        decoder = StreamDecoder()

        def feed(decoder: StreamDecoder = decoder, piece: int = piece) -> None:
            for start in range(0, len(data), piece):
                decoder.feed(data[start : start + piece])

        with pytest.raises(FormatError) as error:
            feed()
        assert WHY[name] in str(error.value)
        assert str(error.value).startswith("byte ")
    with pytest.raises(FormatError):
        read_stream(data)


@pytest.mark.parametrize("largest", [65504.5, 1e30, np.inf, np.nan])
def test_images_of_a_wider_range_are_not_written(largest: float) -> None:
    image = np.zeros((32, 32, 1), np.float32)
    image[3, 4] = largest
    with pytest.raises(InputError, match="within ±65504"):
        encode(image)


def test_limits_that_are_not_given_go_with_the_texels() -> None:
    assert (Limits().texels, Limits().samples, Limits().charts) == (2**28, 12_800_000, 2**18)
    small = Limits(texels=2**22)
    assert (small.samples, small.charts, small.triangles) == (2**22, 2**14, 2**19)
    assert Limits(texels=1).samples == 2**16
    for wrong in ({"texels": 0}, {"texels": 2**31 + 1}, {"charts": 2**19}, {"samples": 1.5}):
        with pytest.raises(InputError, match="limit of"):
            Limits(**wrong)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="allowed: Limits"):
        StreamDecoder(limits=4)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "limits", "message"),
    [
        ("quilt", Limits(texels=65_535), "layout has 65536 texels; allowed here: 65535"),
        ("density_2", Limits(texels=19_267), "layout has 19268 texels; allowed here: 19267"),
        ("quilt", Limits(charts=15), "layout has 16 charts; allowed here: 15; --limit 4096 allows it"),
        (
            "material",
            Limits(samples=8_959),
            "maps have 8960 samples; allowed here: 8959; --limit 8960 allows it",
        ),
        ("mesh", Limits(triangles=319), "mesh has 320 triangles; allowed here: 319; --limit 2560 allows it"),
    ],
)
def test_a_caller_refuses_what_another_takes(name: str, limits: Limits, message: str) -> None:
    data = (REFUSED.parent / f"{name}.uph").read_bytes()
    read_stream(data, limits=Limits(texels=65_536, samples=13_824))
    with pytest.raises(FormatError, match=message):
        read_stream(data, limits=limits)


@pytest.mark.parametrize("name", ["quilt", "density_2", "material", "mesh"])
def test_a_refusal_names_the_limit_that_allows_it(name: str) -> None:
    data, texels = (REFUSED.parent / f"{name}.uph").read_bytes(), [1]
    decoder = None
    while decoder is None:
        try:
            decoder = read_stream(data, limits=Limits(texels=texels[-1]))
        except FormatError as error:
            texels.append(int(str(error).rpartition("; --limit ")[2].removesuffix(" allows it")))
    assert decoder.complete
    assert 1 < len(texels) == len(set(texels))


def test_cells_of_labels_count_like_texels() -> None:
    # A chart of 256 × 256 steps, with cells of 1 step: 258 × 258 of them, and so small that none are coded.
    data = bytes.fromhex(
        "75706803382b530104a3bccd8f4c030f8002e1534597580f4000400003010600008000800080005b81"
        "24515107010300000201029bb5975d"
    )
    read_stream(data, strict=False, limits=Limits(texels=66_564))
    with pytest.raises(FormatError, match="label maps have 66564 cells; allowed here: 65536"):
        read_stream(data, strict=False, limits=Limits(texels=65_536))


def test_samples_of_images_are_limited() -> None:
    data = encode(np.zeros((300, 300, 1), np.uint8))
    decode(data, limits=Limits(samples=90_000))
    with pytest.raises(FormatError, match="the image has 90000 samples; allowed here: 89999"):
        decode(data, limits=Limits(samples=89_999))
