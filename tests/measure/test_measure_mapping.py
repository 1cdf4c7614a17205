"""Size and direction of the texture: against what can be written down, and against differences of sources."""

import dataclasses

import numpy as np
import pytest
from measured import quilt_of, quilt_of_nearest, random_field, warped
from tests.charts.on_patches import laid

from upholster.base.errors import InputError
from upholster.charts.directions.direction import parse_direction
from upholster.charts.layout import density_layout, uniform_layout
from upholster.covering.measure import mapping
from upholster.covering.measure.mapping import _derivative, _turning
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.cyclide import torus
from upholster.geometry.built_in.plane import plane
from upholster.quilt.chart import Chart
from upholster.quilt.placement import PLACEMENT

pytestmark = pytest.mark.usefixtures("few_samples")


def tiled(charts, fields, block=32, exemplar=(128, 128)):
    """Square blocks all over the charts, each from the exemplar's middle."""
    placed = []
    for index, chart in enumerate(charts):
        rows, columns = np.mgrid[block // 2 : chart.height + block : block, 0 : chart.width + block : block]
        part = np.zeros(rows.size, PLACEMENT)
        part["chart"] = index
        part["row"], part["column"] = 16 * rows.ravel() + 8, 16 * columns.ravel() + 8
        placed.append(part)
    placements = np.concatenate(placed)
    placements["source_row"], placements["source_column"] = (8 * side for side in exemplar)
    return quilt_of_nearest(charts, placements, exemplar=exemplar, fields=fields, cell=4)


def asked(text):
    return parse_direction(text, patches=True)


def test_a_flat_copy_is_as_asked():
    quilt = quilt_of([(32, 32, 64, 64, 32, 32, 0)], chart=(64, 64))
    found = mapping(plane(), quilt, scale=64, direction=asked("u"))
    assert (found.within, found.aligned) == (1, 1)
    assert found.error == pytest.approx(0, abs=1e-9)
    assert found.stretch_95 == pytest.approx(1)
    assert found.angle_95 == pytest.approx(0, abs=1e-5)
    twice = mapping(plane(), quilt, scale=128)
    assert twice.error == pytest.approx(1)
    assert twice.within == 0
    assert twice.aligned is twice.angle_95 is None
    assert mapping(plane(), quilt).error == pytest.approx(0, abs=1e-9)


@pytest.mark.slow(reason="lays and measures whole quilts")
@pytest.mark.parametrize("symmetry", range(8))
def test_turns_show_as_directions(symmetry):
    quilt = quilt_of([(32, 32, 64, 64, 40, 40, symmetry)], chart=(64, 64), exemplar=(80, 80))
    # Where the exemplar's columns go on the chart, in degrees clockwise from its columns.
    angle = (0, 270, 180, 90, 90, 180, 270, 0)[symmetry]
    wanted = asked(str(angle))
    assert mapping(plane(), quilt, direction=wanted).angle_95 == pytest.approx(0, abs=1e-5)
    off = mapping(plane(), quilt, direction=asked(str(angle + 7)))
    assert off.angle_95 == pytest.approx(7, abs=1e-6)
    assert off.aligned == 0
    opposite = mapping(plane(), quilt, direction=asked(str(angle + 180)))
    assert opposite.angle_95 == pytest.approx(180, abs=1e-5)


def test_vectors_count_along_the_surface():
    quilt = quilt_of([(32, 32, 64, 64, 32, 32, 0)], chart=(64, 64))
    for text, angle in (("1,0,0", 0), ("-1,0,0", 180), ("1,0,10", 0), ("0,1,0", 90)):
        found = mapping(plane(), quilt, direction=asked(text))
        assert found.angle_95 == pytest.approx(angle, abs=1e-5)
    with pytest.raises(InputError, match="nowhere along the surface"):
        mapping(plane(), quilt, direction=asked("0,0,1"))


def test_the_derivative_is_that_of_the_sources():
    rng = np.random.default_rng(2)
    field = random_field(rng, 200, 200, 0.8)
    centre = rng.integers(40, 160, (300, 2))
    place = centre + rng.integers(-30, 31, (300, 2))
    place = place[(place % 32 != 0).all(axis=1)]  # at a node the slope jumps
    centre = centre[: len(place)]

    def offset(q):
        nodes = field.matrices / 4096
        at = 1 + q / 32
        i, j = at.astype(int).T
        x, y = (at - at.astype(int)).T
        rows = ((nodes[i, j].T * (1 - y) + nodes[i, j + 1].T * y) * (1 - x)).T
        rows = rows + ((nodes[i + 1, j].T * (1 - y) + nodes[i + 1, j + 1].T * y) * x).T
        return rows.reshape(-1, 2, 2)

    def source(q):
        return 0.5 * np.einsum("nij,nj->ni", offset(centre * 1.0) + offset(q), q - centre)

    step = 1e-4
    expected = np.stack(
        [(source(place + d * step) - source(place - d * step)) / (2 * step) for d in np.eye(2)], axis=2
    )
    np.testing.assert_allclose(_derivative(field, offset(centre * 1.0), centre, place), expected, atol=1e-6)


def test_beyond_the_nodes_the_field_is_constant():
    field = random_field(np.random.default_rng(0), 64, 64, 1.0)
    centre, place = np.array([[300, 300]]), np.array([[310, 290]])
    expected = field.matrices[-1, -1].reshape(2, 2) / 4096
    np.testing.assert_allclose(_derivative(field, expected[None], centre, place)[0], expected)


@pytest.mark.parametrize("scale", [0.6, 1.5])
def test_sizes_against_the_quilts_own_sources(scale):
    quilt = warped(np.random.default_rng(3), scale, chart=(160, 160), block=40, exemplar=(512, 512))
    found = mapping(plane(), quilt, scale=160 * scale)
    sources = quilt.sources()[0] / 16
    # Differences over 8 texels inside blocks: areas of small squares in the exemplar.
    ratios = []
    for r in range(8, 160, 40):
        for c in range(8, 160, 40):
            part = sources[r - 8 + 10 : r + 20, c - 8 + 10 : c + 20]
            down, right = part[8:, :-8] - part[:-8, :-8], part[:-8, 8:] - part[:-8, :-8]
            area = np.abs(down[..., 0] * right[..., 1] - down[..., 1] * right[..., 0]) / 64
            ratios.append(np.abs(0.5 * np.log2(area / scale**2)).ravel())
    expected = np.concatenate(ratios).mean()
    assert found.error == pytest.approx(expected, rel=0.2)
    assert 0.01 < expected < 0.2


@pytest.mark.slow(reason="lays and measures whole quilts")
@pytest.mark.parametrize(("spec", "text"), [("torus", "v"), ("cyclide", "30"), ("sphere", "level")])
def test_fields_keep_what_they_promise(spec, text):
    surface = surface_from_spec(spec)
    charts = density_layout(surface, texels=2**18)
    density = np.sqrt(2**18 / 100)
    quilt = tiled(charts, laid(surface, charts, text, density)[1])
    found = mapping(surface, quilt, scale=density, direction=asked(text))
    assert found.within > 0.9
    assert found.aligned > 0.9
    assert found.stretch_95 < 1.4
    less = mapping(surface, quilt, scale=1.2 * density, direction=asked("75"))
    assert less.within < 0.1
    assert less.aligned < 0.1


def test_one_texel_to_a_pixel_stretches_as_texels_do():
    quilt = tiled(uniform_layout(torus(3, 1), chart=64), ())
    found = mapping(torus(3, 1), quilt, direction=asked("v"))
    assert found.stretch_95 > 2
    assert found.within < 0.5
    assert found.angle_95 == pytest.approx(90, abs=2)


def test_bad_input_is_refused():
    quilt = quilt_of([(32, 32, 64, 64, 32, 32, 0)], chart=(64, 64))
    for scale in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="scale"):
            mapping(plane(), quilt, scale=scale)
    elsewhere = dataclasses.replace(quilt, charts=(Chart(3, 64, 64),))
    with pytest.raises(InputError, match="face 3"):
        mapping(plane(), elsewhere)


def test_how_fast_directions_turn_is_that_of_small_steps():
    rng = np.random.default_rng(4)
    corners, asked = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 3, 3))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    asked -= (asked * normal[:, None]).sum(axis=2, keepdims=True) * normal[:, None]
    shares = rng.dirichlet(np.ones(3), 50)

    def at(share):
        return (asked * share[:, :, None]).sum(axis=1)

    fastest = np.zeros(50)
    for way in np.linspace(0, np.pi, 720):
        step = np.array([np.cos(way), np.sin(way)])
        moved = 1e-7 * np.stack(
            [-step.sum() * np.ones(50), step[0] * np.ones(50), step[1] * np.ones(50)], axis=1
        )
        far = np.linalg.norm((corners * moved[:, :, None]).sum(axis=1), axis=1)
        here, there = at(shares), at(shares + moved)
        angle = (np.cross(here, there) * normal).sum(axis=1) / (here * there).sum(axis=1)
        fastest = np.maximum(fastest, np.degrees(np.abs(angle)) / far)
    found = _turning(corners, asked, at(shares))
    np.testing.assert_allclose(found, fastest, rtol=2e-3)
