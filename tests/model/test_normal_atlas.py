"""The atlas of a normal map: one vector in space stays one vector across every edge."""

from typing import Any

import numpy as np
import pytest
from patch_charts import patch_charts

from upholster.base.errors import InputError
from upholster.charts.chart_seams import find_seams
from upholster.charts.layout import density_layout
from upholster.charts.tessellation.mesh import face_parameters
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.revolution import cylinder
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.surface import Surface
from upholster.model.atlas import build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels

SIZE = (48, 40)


def in_frames(surface: Surface, charts: tuple[Chart, ...], dtype: Any) -> Texels:
    """Charts that show one vector of space, each texel in its own frame."""
    vector = np.array([0.5, 0.3, 0.4])
    arrays = []
    for chart in charts:
        s, t = face_parameters(chart, np.arange(chart.height) + 0.5, np.arange(chart.width) + 0.5)
        _, by_s, by_t = surface.faces[chart.face].derivatives_grid(s, t)
        normal = np.cross(by_s, by_t)
        axes = [by_t, np.cross(normal, by_t), normal]
        unit = [axis / np.linalg.norm(axis, axis=-1, keepdims=True) for axis in axes]
        samples = np.stack([axis @ vector for axis in unit], axis=-1) / 2 + 0.5
        arrays.append((samples if dtype == np.float32 else np.rint(samples * 65535)).astype(dtype))
    return Texels(charts, tuple(arrays))


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
@pytest.mark.parametrize(
    "surface", [sphere(), ring_cyclide(), cylinder()], ids=["sphere", "cyclide", "cylinder"]
)
@pytest.mark.parametrize("across", [False, True], ids=["patches", "across patches"])
def test_a_vector_goes_on_beyond_every_edge(surface: Surface, dtype: Any, across: bool) -> None:
    sizes = [SIZE] * len(surface.patches)
    charts = density_layout(surface, texels=30_000) if across else patch_charts(surface, sizes)
    texels = in_frames(surface, charts, dtype)
    seams = find_seams(surface, charts)
    top = 1 if dtype == np.float32 else 65535
    worst = []
    for atlas in (build_normal_atlas(surface, texels, seams), build_atlas(texels, seams)):
        steps = []
        for cell, array in zip(atlas.cells, texels.arrays, strict=True):
            part = atlas.pixels[
                cell.row - 1 : cell.row + array.shape[0] + 1,
                cell.column - 1 : cell.column + array.shape[1] + 1,
            ]
            np.testing.assert_array_equal(part[1:-1, 1:-1], array)
            outer = [part[0, 1:-1], part[-1, 1:-1], part[1:-1, 0], part[1:-1, -1]]
            inner = [array[0], array[-1], array[:, 0], array[:, -1]]
            corners = [(part[0, 0], array[0, 0]), (part[-1, -1], array[-1, -1])]
            for beyond, own in [*zip(outer, inner, strict=True), *corners]:
                steps.append(np.abs(beyond.astype(float) - own).max() / top)
        worst.append(max(steps))
    assert worst[0] < 0.05
    if len(surface.patches) == 6 and surface.shared:
        assert worst[1] > 0.3  # the sphere's charts meet at right angles: the test can fail


def test_only_three_channels_are_normals() -> None:
    surface = sphere()
    texels = in_frames(surface, patch_charts(surface, [SIZE] * 6), np.float32)
    with pytest.raises(InputError, match="2 channels; allowed: 3"):
        build_normal_atlas(
            surface, Texels(texels.charts, tuple(array[:, :, :2] for array in texels.arrays)), ()
        )
