"""Charts are cut where the direction turns about a point, and the texture there is of the right size."""

import numpy as np
import pytest

from upholster.charts.corner_fit import Corner
from upholster.charts.directions import direction_fields, parse_direction
from upholster.charts.layout import density_layout
from upholster.charts.poles import LEAST, cut_at_poles
from upholster.geometry import surface_from_spec

SPHERE = surface_from_spec("sphere")


def cut(spec, direction, texels):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=texels)
    return charts, *cut_at_poles(surface, charts, parse_direction(direction))


def corner_of(chart, corner):
    at = chart.s1 if corner.down else chart.s0, chart.t1 if corner.right else chart.t0
    return SPHERE.faces[chart.face].points(*np.array(at)[:, None])[0]


@pytest.mark.parametrize(
    ("direction", "pole"),
    [
        ("around:z", (0, 0, 1)),
        ("level", (0, 0, 1)),
        ("around:x", (1, 0, 0)),
        ("0,1,0", (0, 1, 0)),
        ("around:0.1,-0.2,1", np.array([0.1, -0.2, 1]) / np.sqrt(1.05)),
    ],
)
@pytest.mark.parametrize("texels", [200_000, 1_500_000])
def test_four_charts_meet_in_each_pole(direction, pole, texels):
    before, charts, corners = cut("sphere", direction, texels)
    assert len(corners) == 8
    near = [corner_of(charts[n], corner) for n, corner in corners.items()]
    texel = np.sqrt(4 * np.pi / texels)
    for sign in (1, -1):
        assert (np.linalg.norm(near - sign * np.array(pole), axis=1) < texel).sum() == 4
    faces = {charts[n].face for n in corners}
    assert {chart for chart in before if chart.face not in faces} <= set(charts)
    assert min(min(chart.height, chart.width) for chart in charts) >= LEAST
    # They cover what the charts before covered, with texels as large.
    for part in (before, charts):
        area = sum((chart.s1 - chart.s0) * (chart.t1 - chart.t0) for chart in part)
        assert area == pytest.approx(len(SPHERE.faces), abs=1e-12)
    count = sum(chart.height * chart.width for chart in charts)
    assert count == pytest.approx(sum(chart.height * chart.width for chart in before), rel=0.015)


@pytest.mark.parametrize("spec", ["torus", "cyclide", "vase", "ellipsoid", "cone", "sphere:tiling=octants"])
@pytest.mark.parametrize("direction", ["around:z", "level", "u", "v", "30"])
def test_others_stay_whole(spec, direction):
    before, charts, corners = cut(spec, direction, 300_000)
    assert (charts, corners) == (before, {})


def test_directions_along_patches_have_no_poles():
    for direction in ("u", "v", "45"):
        assert cut("sphere", direction, 300_000)[2] == {}


def test_a_line_where_directions_vanish_is_no_pole():
    # Straight up, on the circle along which a ring lies flat.
    assert cut("torus", "0,0,1", 300_000)[2] == {}
    assert cut("plane", "0,0,1", 300_000)[2] == {}
    assert cut("plane", "level", 300_000)[2] == {}


def test_a_flat_place_has_a_pole_too():
    _, charts, corners = cut("plane", "around:z", 300_000)
    assert len(charts) == 8
    assert list(corners.values()) == [
        Corner(down, right) for down in (True, False) for right in (True, False)
    ]


def test_sizes_hold_round_a_pole():
    scale = 500.0
    charts = density_layout(SPHERE, density=scale)
    direction = parse_direction("around:z")
    worst = []
    for parts, corners in ((charts, {}), cut_at_poles(SPHERE, charts, direction)):
        fields = direction_fields(SPHERE, parts, direction, scale, corners=corners)
        sizes = [np.inf]
        for chart, field in zip(parts, fields, strict=True):
            rows, columns = np.meshgrid(np.arange(chart.height), np.arange(chart.width), indexing="ij")
            s = chart.s0 + (chart.s1 - chart.s0) * (rows + 0.5) / chart.height
            t = chart.t0 + (chart.t1 - chart.t0) * (columns + 0.5) / chart.width
            points, down, right = SPHERE.faces[chart.face].derivatives(s.ravel(), t.ravel())
            near = np.hypot(points[:, 0], points[:, 1]) < 64 / scale
            step = (chart.s1 - chart.s0) / chart.height * (chart.t1 - chart.t0) / chart.width
            area = np.linalg.norm(np.cross(down, right), axis=1)[near] * step * scale**2
            found = np.linalg.det(field.at(rows.ravel()[near], columns.ravel()[near]))
            sizes += np.sqrt(np.maximum(found, 0) / area).tolist()
        worst.append(min(sizes))
    assert worst[0] < 0.05
    assert worst[1] > 0.75
