"""Painting a window of a chart gives the texels that painting all charts gives there."""

from pathlib import Path

import numpy as np
import pytest

import upholster
from upholster.image import Material
from upholster.quilt import Quilt, paint_material
from upholster.quilt.plans import PlacementList
from upholster.quilt.windows import map_pyramid, paint_window

SAMPLE = Path(__file__).parent.parent.parent / "examples" / "weave.png"


def _alone(quilt: Quilt, n: int) -> Quilt:
    placed = quilt.on_chart(n).copy()
    placed["chart"] = 0
    plan = PlacementList(placed, quilt.mask_cells)
    return Quilt((quilt.charts[n],), quilt.exemplar_shape, plan, (quilt.fields[n],))


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_a_window_has_the_texels_of_the_whole(dtype):
    sample = upholster.read_exemplar(SAMPLE)[:64, :64]
    sample = sample if dtype == np.uint8 else (sample / 255).astype(dtype)
    height = sample[:, :, 1:2].copy()
    material = Material({"albedo": sample, "height": height, "normal": sample.copy()})
    quilt = upholster.synthesize(material, "torus:R=2,r=0.7", texels=40_000, sample_size=0.9, threads=1)
    whole = paint_material(quilt, material, threads=1)
    assert len(quilt.charts) > 2
    for n in (0, len(quilt.charts) - 1):
        high, wide = quilt.charts[n].height, quilt.charts[n].width
        alone = _alone(quilt, n)
        windows = (None, np.s_[0:9, 0:wide], np.s_[5:high, wide - 7 : wide], np.s_[high // 2 : high, 3:20])
        for role, image in material.maps.items():
            for pyramid in (None, map_pyramid(role, image)):
                for window in windows:
                    found = paint_window(alone, role, image, window, pyramid=pyramid, threads=1)
                    expected = whole[role].arrays[n][window or np.s_[:, :]]
                    np.testing.assert_array_equal(found, expected)
