"""Streams that ask for what no decoder may give: frozen ones, refused by the number that is wrong."""

from pathlib import Path

import numpy as np
import pytest

from upholster import Limits, codec
from upholster.errors import FormatError, InputError
from upholster.quilt import Chart
from upholster.quilt.placement import PLACEMENT
from upholster.stream import StreamDecoder, read_stream
from upholster.stream.budget import painting_work

REFUSED = Path(__file__).parents[1] / "vectors" / "refused"

WHY = {
    "grid_beyond": "last position of a grid is 1048584; allowed: up to 1048576",
    "range_beyond": "allowed: rising, within ±65504",
    "normal_of_one_channel": "map 'normal' has 1 channels; allowed: 3",
    "chunks_4097": "chunk 4097; allowed: 4096 in a file",
    "cells_beyond": "masks have 33554432 cells; allowed here: 4194560",
    "work_of_blocks": "placements take 536870912 units of work or more; allowed here: 69206016",
    "work_of_cuts": "placements take 352321536 units of work or more; allowed here: 69206016",
    "work_of_grids": "placements take 1199064064 units of work or more; allowed here: 69206016",
    "maps_together": "all maps take 42949672960 units of work or more; allowed here: 34426847232",
    "work_of_strips": "placements take 22548578304 units of work or more; allowed here: 75497472",
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


def test_limits_that_are_not_told_go_with_the_texels() -> None:
    assert (Limits().texels, Limits().samples, Limits().charts) == (2**28, 12_800_000, 2**18)
    small = Limits(texels=2**22)
    assert (small.samples, small.charts, small.triangles, small.work) == (2**22, 2**14, 2**19, 128)
    assert Limits(texels=1).samples == 2**16
    for wrong in ({"texels": 0}, {"texels": 2**31 + 1}, {"work": 129}, {"samples": 1.5}):
        with pytest.raises(InputError, match="limit of"):
            Limits(**wrong)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="allowed: Limits"):
        StreamDecoder(limits=4)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "limits", "message"),
    [
        ("quilt", Limits(texels=37_759), "layout has 37760 texels; allowed here: 37759"),
        ("quilt", Limits(charts=11), "layout has 12 charts; allowed here: 11"),
        ("quilt", Limits(samples=13_823), "maps have 13824 samples; allowed here: 13823"),
        ("mesh", Limits(triangles=319), "number of triangles is 320; allowed: 1 to 319"),
    ],
)
def test_a_caller_refuses_what_another_takes(name: str, limits: Limits, message: str) -> None:
    data = (REFUSED.parent / f"{name}.uph").read_bytes()
    read_stream(data, limits=Limits(texels=37_760, samples=13_824))
    with pytest.raises(FormatError, match=message):
        read_stream(data, limits=limits)


def test_samples_of_images_are_limited() -> None:
    data = codec.encode(np.zeros((300, 300, 1), np.uint8))
    codec.decode(data, limits=Limits(samples=90_000))
    with pytest.raises(FormatError, match="the image has 90000 samples; allowed here: 89999"):
        codec.decode(data, limits=Limits(samples=89_999))


def test_work_is_counted_as_the_specification_says() -> None:
    placed = np.zeros(3, PLACEMENT)
    placed["height"], placed["width"], placed["row"], placed["column"] = 20, 30, 10, 15
    placed["row"][1] = 0  # half of it lies before the chart
    placed["mask"][1:], placed["mask_cell"][1:], placed["feather"][1:] = 2, 4, 2
    placed["mask_cell"][2] = 7
    chart = Chart(0, 12, 30)
    whole, cut = 4 * 12 * 30, 4 * 10 * 30 + 12 * 30 * 3
    # Of rows -10 … 9 cells of 4 from -2 on are seen, which begin at -2; of rows 0 … 19 cells of 7 to row 13.
    assert painting_work(placed[:1], (chart,)) == whole
    assert painting_work(placed[:2], (chart,)) == whole + cut
    assert painting_work(placed, (chart,)) == 2 * whole + cut + 14 * 30 * 3
