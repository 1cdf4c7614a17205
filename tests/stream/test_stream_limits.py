"""Streams that ask for what no decoder may give: frozen ones, refused by the number that is wrong."""

from pathlib import Path

import numpy as np
import pytest

from upholster import codec
from upholster.errors import FormatError, InputError
from upholster.stream import StreamDecoder, read_stream

REFUSED = Path(__file__).parents[1] / "vectors" / "refused"

WHY = {
    "grid_beyond": "last position of a grid is 1048584; allowed: up to 1048576",
    "range_beyond": "allowed: rising, within ±65504",
    "normal_of_one_channel": "map 'normal' has 1 channels; allowed: 3",
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
        codec.encode(image)
