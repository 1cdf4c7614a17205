"""Sizes by a map: as asked, and no faster than blocks can follow."""

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.charts.charted_surface import ChartedSurface, charted_patches
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.patch_directions import vectors_on_patches
from upholster.charts.layout import density_layout
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.phases.phase_cells import phase_field
from upholster.charts.size_map import FOLLOWED, SizeField, parse_size_map, size_field
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.image.files.write import write_image

PLANE = surface_from_spec("plane")
CHARTED = charted_patches(PLANE, density_layout(PLANE, density=200.0, largest=1000))
VECTORS = vectors_on_patches(PLANE, CHARTED, parse_direction("u", patches=True)).vectors
BLOCK = 0.1


def sized(text, block=BLOCK):
    """Return sizes on the plane, and its triangles."""
    ground = MapGround(CHARTED, None, PLANE, False)
    return size_field(parse_size_map(text), ground, CHARTED, VECTORS, block)


def across(tmp_path, values):
    """Write an image of columns of grey, 0 to 1; return its name."""
    path = tmp_path / "grey.png"
    grey = np.rint(65535 * np.asarray(values)).astype(np.uint16)
    write_image(path, np.broadcast_to(grey, (4, len(grey)))[..., None])
    return str(path)


def test_between_the_ends_sizes_are_geometric(tmp_path):
    sizes, charted, vectors, parent = sized(f"{across(tmp_path, np.linspace(0, 1, 200))}=0.5,2", 0.02)
    share = charted.places[..., 1] / CHARTED.charts[0].width
    np.testing.assert_allclose(sizes.factors, 0.5 * 4**share, rtol=0.02)
    assert sizes.smoothed == 0
    assert vectors.shape == charted.mesh.corners.shape
    assert parent.max() < len(CHARTED.chart)
    assert (sizes.least, sizes.most) == (sizes.factors.min(), sizes.factors.max())


def test_they_change_no_faster_than_blocks_follow(tmp_path):
    sizes, charted, _, _ = sized(f"{across(tmp_path, np.arange(64) >= 32)}=0.5,2")
    corners = charted.mesh.corners
    for k in range(3):
        length = np.linalg.norm(corners[:, k] - corners[:, k - 1], axis=1)
        change = np.abs(sizes.factors[:, k] - sizes.factors[:, k - 1])
        assert (change <= FOLLOWED / BLOCK * length * (1 + 1e-9)).all()
    share = charted.places[..., 1] / CHARTED.charts[0].width
    assert sizes.factors[share < 0.02].max() < 0.51
    assert sizes.factors[share > 0.98].min() > 1.99
    # The mean of two ramps, up to the jump from one side and from it to the other.
    middle = sizes.factors[np.abs(share - 0.5) < 0.01]
    assert np.abs(middle - 1.25).max() < 0.1
    assert 0.5 < sizes.smoothed < 0.95


def test_one_size_is_that_everywhere_and_nothing_asked_is_once(tmp_path):
    assert (sized("height=2,2")[0].factors == 2).all()
    path = tmp_path / "half.png"
    image = np.full((4, 8, 2), 255, np.uint8)
    image[:, 4:, 1] = 0
    write_image(path, image)
    sizes, charted, _, _ = sized(f"{path}=1,3", 0.01)
    share = charted.places[..., 1] / CHARTED.charts[0].width
    np.testing.assert_allclose(sizes.factors[share < 0.4], 3, rtol=1e-6)
    np.testing.assert_allclose(sizes.factors[share > 0.6], 1, rtol=1e-6)


def test_points_have_the_size_between_the_corners():
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(50, 3, 3))
    factors = rng.uniform(0.5, 2, (50, 3))
    shares = rng.dirichlet((1, 1, 1), 50)
    sizes = SizeField(corners, factors, 0.0)
    found = sizes.at(np.arange(50), (shares[..., None] * corners).sum(axis=1))
    np.testing.assert_allclose(found, (shares * factors).sum(axis=1), rtol=1e-6)
    np.testing.assert_allclose(sizes.at(np.arange(50), corners[:, 1]), factors[:, 1], rtol=1e-6)


def test_warp_fields_show_the_size(tmp_path):
    sizes, charted, vectors, _ = sized(f"{across(tmp_path, np.linspace(0, 1, 200))}=0.25,4", 0.02)
    along, down = triangle_frames(charted.mesh, vectors)
    once, by_map = (
        warp_fields(charted, along, down, 100.0, None, vectors, factors)[0]
        for factors in (None, sizes.factors)
    )
    rows, columns = np.meshgrid(np.arange(10, 190, 20), np.arange(10, 190, 20), indexing="ij")
    found = np.linalg.det(once.at(rows, columns)) / np.linalg.det(by_map.at(rows, columns))
    wanted = 0.25 * 16 ** ((columns + 0.5) / 200)
    np.testing.assert_allclose(np.sqrt(found), wanted, rtol=0.06)


def test_phases_of_one_size_are_those_of_a_sample_so_large():
    sizes, charted, vectors, _ = sized("height=2,2")
    waves = np.array([(1 / 16, 0.0), (0.0, 1 / 24)])
    by_map = phase_field(charted, vectors, 200.0, waves, sizes)
    larger = phase_field(charted, vectors, 100.0, waves)
    np.testing.assert_allclose(by_map.cells.own, larger.cells.own)
    triangles = np.arange(len(charted.chart), dtype=np.int32)
    points = charted.mesh.corners.mean(axis=1)
    apart = by_map.at(triangles, points) - larger.at(triangles, points)  # int16 wraps, as phases do
    assert np.abs(apart).max() <= 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("height", "TARGET=LOW,HIGH"),
        ("height=2", "TARGET=LOW,HIGH"),
        ("height=a,b", "TARGET=LOW,HIGH"),
        ("height=0.1,1", "0.1 and 1 times the size; allowed: 1/8 to 8"),
        ("height=1,9", "1/8 to 8"),
        ("=1,2", "map is ''"),
        ("colour=1,2", "map is 'colour'"),
    ],
)
def test_wrong_texts_are_reported_in_a_line(text, words):
    with pytest.raises(InputError, match=words):
        parse_size_map(text)


def test_a_map_that_says_nothing_is_refused(tmp_path):
    path = tmp_path / "clear.png"
    write_image(path, np.zeros((4, 4, 2), np.uint8))
    with pytest.raises(InputError, match="has no value anywhere"):
        sized(f"{path}=1,2")


def test_files_in_it_are_renamed():
    wanted = parse_size_map(" 1-maps/a b.png>0.5 = 0.5, 2")
    assert wanted.named(str.upper) == "1-MAPS/A B.PNG>0.5=0.5,2.0"
    assert parse_size_map(wanted.named(str)) == parse_size_map("1-maps/a b.png>0.5=0.5,2")
    assert parse_size_map("height=0.5,2").named(str.upper) == "height=0.5,2.0"


def test_seams_are_crossed():
    # Charts of a sphere: sizes are the same on both sides of their seams.
    sphere = surface_from_spec("sphere")
    charted = charted_patches(sphere, density_layout(sphere, density=40.0, largest=1000))
    vectors = np.repeat(charted.mesh.corners[:, 1:2] - charted.mesh.corners[:, :1], 3, axis=1)
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    ground = MapGround(charted, None, sphere, False)
    sizes, fine, _, _ = size_field(parse_size_map("facing:x=0.5,2"), ground, charted, vectors, 0.2)
    assert isinstance(fine, ChartedSurface)
    assert len(fine.charts) > 1
    low, high = np.full(len(fine.mesh.positions), np.inf), np.zeros(len(fine.mesh.positions))
    np.minimum.at(low, fine.mesh.triangles, sizes.factors)
    np.maximum.at(high, fine.mesh.triangles, sizes.factors)
    used = high > 0
    np.testing.assert_array_equal(low[used], high[used])
