"""The side to which the maps of a sample are resized to fit in a stream."""

import numpy as np
import pytest

from upholster.codec import MAX_SAMPLES
from upholster.codec.header import MAX_PLACES
from upholster.codec.tree import tree_size
from upholster.stream import fitting_side
from upholster.stream.maps import MAX_MAP_SAMPLES


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
