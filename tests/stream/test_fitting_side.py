"""The side to which the maps of a sample are resized to fit in a stream."""

import numpy as np
import pytest

from upholster import InputError, cover
from upholster.codec.header import MAX_PLACES, MAX_SAMPLES
from upholster.codec.stream.maps import MAX_MAP_SAMPLES
from upholster.codec.stream.sample import fitting_side
from upholster.codec.tree import tree_size
from upholster.image.files.material import Material


@pytest.mark.parametrize(
    ("size", "channels"),
    [
        ((3000, 4000), (3,)),
        ((1033, 1033), (3,)),
        ((4096, 4096), (4, 3, 1, 1, 1)),
        ((2048, 2048), (3, 3, 3, 1, 1, 1, 1, 1)),
        ((196, 4096), (4,)),
        ((4096, 270), (3, 1)),
    ],
)
def test_maps_of_the_side_fit_and_are_little_smaller_than_they_may_be(size, channels):
    def maps(height, width):
        return [np.broadcast_to(np.uint8(0), (height, width, count)) for count in channels]

    side = fitting_side(maps(*size))
    height, width = (round(each * side / max(size)) for each in size)
    samples = [height * width * count for count in channels]
    assert max(samples) <= MAX_SAMPLES
    assert sum(samples) <= MAX_MAP_SAMPLES
    assert tree_size(height, width, max(channels), 6) <= MAX_PLACES
    assert max(max(samples) / MAX_SAMPLES, sum(samples) / MAX_MAP_SAMPLES) > 0.93
    assert fitting_side(maps(height, width)) is None


@pytest.mark.parametrize(("size", "channels"), [((900, 1300), 3), ((1024, 1024), 14)])
def test_a_stream_refuses_a_sample_of_many_pixels_before_the_work_and_names_the_cure(
    tmp_path, size, channels
):
    noise = np.random.default_rng(0).integers(0, 256, (*size, 3), np.uint8)
    maps = {"albedo": noise}
    if channels > 3:  # each map fits, but not all together
        maps |= dict.fromkeys(("normal", "emission"), noise)
        maps |= dict.fromkeys(("roughness", "metallic", "ao", "height"), noise[..., :1])
    source = Material(maps) if channels > 3 else noise
    side = fitting_side(list(maps.values()))
    with pytest.raises(InputError, match=rf"{size[1]}x{size[0]} pixels.*--resize {side}$"):
        cover(source, "plane", str(tmp_path / "x.uph"))
