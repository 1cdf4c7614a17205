"""Directions: how they are read, which one suits patches, and that what is asked for is followed."""

import numpy as np
import pytest
from tests.charts.on_patches import laid

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.charted_surface import charted_patches
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.patch_directions import default_on_patches
from upholster.charts.layout import density_layout
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart


def of_size(vectors: FloatArray) -> FloatArray:
    """Return vectors (…, 3) of length 1, or 0."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def asked(text: str, points: FloatArray, by_s: FloatArray, by_t: FloatArray) -> FloatArray:
    """Return which way rows shall run at points of patches, (…, 3), by its definition."""
    normal = of_size(np.cross(by_s, by_t))
    if text in ("around:z", "level"):
        along = np.cross((0.0, 0.0, 1.0), points if text == "around:z" else normal)
        return of_size(along - (along * normal).sum(axis=-1, keepdims=True) * normal)
    along = of_size(by_s if text == "v" else by_t)
    turn = np.radians(30 if text == "30" else 0)
    return np.cos(turn) * along + np.sin(turn) * np.cross(along, normal)


# On the cyclide level says nothing over all that lies nearly flat; on the sphere nothing beside the poles.
@pytest.mark.slow(reason="lays quilts on every kind of surface")
@pytest.mark.parametrize(
    ("spec", "text"),
    [
        *(
            (spec, text)
            for spec in ("cyclide", "torus", "vase", "cone")
            for text in ("u", "v", "30", "around:z")
        ),
        *(("torus", "level"), ("vase", "level"), ("sphere", "level"), ("sphere", "around:z")),
    ],
)
def test_size_and_direction_are_followed(spec: str, text: str) -> None:
    surface, scale = surface_from_spec(spec), 40.0
    charted, fields = laid(surface, density_layout(surface, texels=600_000), text, scale)
    areas, sizes, angles = [], [], []
    for chart, field in zip(charted.charts, fields, strict=True):
        i, j = np.meshgrid(np.arange(2.0, chart.height, 5), np.arange(2.0, chart.width, 5), indexing="ij")
        by_row, by_column = (chart.s1 - chart.s0) / chart.height, (chart.t1 - chart.t0) / chart.width
        s, t = chart.s0 + by_row * (i + 0.5), chart.t0 + by_column * (j + 0.5)
        points, by_s, by_t = surface.faces[chart.face].derivatives(s, t)
        areas.append(np.linalg.norm(np.cross(by_s, by_t), axis=2).ravel() * by_row * by_column)
        m = field.at(i, j)
        sizes.append(np.sqrt(np.linalg.det(m).ravel() / np.maximum(areas[-1], 1e-30)) / scale)
        there = np.linalg.inv(m)[..., 1]  # where the sample's columns go, in steps
        along = of_size(by_s * by_row * there[..., :1] + by_t * by_column * there[..., 1:])
        # Opposite directions count as one: charts follow lines, blocks are turned.
        cosine = np.abs((along * asked(text, points, by_s, by_t)).sum(axis=2))
        angles.append(np.degrees(np.arccos(np.minimum(cosine, 1))).ravel())
    area = np.concatenate(areas)
    right = np.abs(np.log(np.concatenate(sizes))) <= np.log(1.05)
    assert np.average(right, weights=area) > (0.88 if spec == "vase" else 0.93)
    assert np.average(np.concatenate(angles) <= 5, weights=area) > 0.95


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        ("cyclide", "v"),
        ("torus", "v"),
        ("torus:R=2,r=1.9", "v"),
        ("vase", "u"),
        ("cone", "u"),
        ("plane:spans=2x2", "u"),
        ("sphere", "level"),
    ],
)
def test_the_default_suits_the_surface(spec, text):
    surface = surface_from_spec(spec)
    charted = charted_patches(surface, density_layout(surface, texels=300_000))
    assert default_on_patches(surface, charted) == text


def test_creases_are_unfolded():
    # Two squares, one lying, one standing: u goes on round the crease.
    lying = [[[0, 0, 0], [1, 0, 0]], [[0, -1, 0], [1, -1, 0]]]
    standing = [[[1, 0, 0], [1, 0, -1]], [[1, -1, 0], [1, -1, -1]]]
    patches = [RationalPatch.from_points(np.array(x, float)) for x in (lying, standing)]
    charts = (Chart(0, 32, 32), Chart(1, 32, 32))
    surface = Surface(patches)
    assert default_on_patches(surface, charted_patches(surface, charts)) == "u"
    turned = RationalPatch.from_points(
        np.array([[standing[1][0], standing[0][0]], [standing[1][1], standing[0][1]]])
    )
    surface = Surface([patches[0], turned])
    assert default_on_patches(surface, charted_patches(surface, charts)) == "level"


@pytest.mark.parametrize(
    "text", ["u", " v ", "45", "-1e1", "1,2,3", "z", "smooth", "around:z", "around: 0,1,1", "1e300,0,0"]
)
def test_directions_are_read(text):
    found = parse_direction(text, patches=True)
    assert found.text == text.strip()
    if callable(found.vectors):
        assert np.asarray(found.vectors(np.ones((5, 3)))).shape == (5, 3)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "w",
        "uv",
        "1,2",
        "1,2,3,4",
        "around",
        "around:",
        "around:w",
        "nan",
        "inf,0,0",
        "0,0,0",
        "around:0,0,0",
        "u:z",
        "1e9",
        "1e400,0,0",
    ],
)
def test_wrong_directions_are_refused(text):
    with pytest.raises(InputError, match=r"direction is .*; allowed: ") as caught:
        parse_direction(text, patches=True)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="direction is a list"):
        parse_direction([1, 2, 3, 4])


def test_degrees_count_from_u_on_patches_and_from_level_elsewhere() -> None:
    assert parse_direction("30", patches=True).kind == "u"
    assert parse_direction("30").kind == "level"
    for wanted in ("u", "v", parse_direction("u", patches=True)):
        with pytest.raises(InputError, match="on patches u and v"):
            parse_direction(wanted)
