"""Directions of images over texture coordinates: as glTF's KHR_materials_anisotropy has them."""

import numpy as np
import pytest
from meshes import height_field, on_charts

from upholster.base.errors import InputError
from upholster.charts.charted_surface import charted_patches
from upholster.charts.directions.coordinate_directions import vectors_on_coordinates
from upholster.charts.directions.detail import in_detail
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.direction_image import read_direction_image
from upholster.charts.directions.field import direction_field
from upholster.charts.directions.level_directions import requested_at_corners
from upholster.charts.directions.patch_directions import vectors_on_patches
from upholster.charts.layout import density_layout
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.image.files.write import write_image


def image_of(path, along, strength=1.0, dtype=np.uint8):
    """Write directions (H, W, 2), x right and y up, with their strength, as an image; return its name."""
    rgb = np.concatenate([along * 0.5 + 0.5, np.broadcast_to(strength, (*along.shape[:2], 1))], axis=2)
    write_image(path, np.rint(rgb * np.iinfo(dtype).max).astype(dtype))
    return str(path)


def everywhere(path, x, y, strength=1.0):
    """Write an image of one direction."""
    return image_of(path, np.broadcast_to(np.array([x, y]) / np.hypot(x, y), (4, 4, 2)), strength)


def with_uv(mesh, turn):
    """Return a flat mesh over the unit square with coordinates: as x and y lie, turned about the middle."""
    flat = mesh.corners[..., :2] - 0.5
    uv = np.stack([flat[..., 0], -flat[..., 1]], axis=-1) @ np.array(turn).T + 0.5
    return TriangleMesh(mesh.positions, mesh.triangles, uv=uv)


@pytest.mark.parametrize(
    ("turn", "right", "up"),
    [
        ([[1, 0], [0, 1]], (1, 0), (0, 1)),
        ([[0, 1], [-1, 0]], (0, -1), (1, 0)),  # u runs down, v to the left: seen from outside not mirrored
        ([[-1, 0], [0, 1]], (-1, 0), (0, 1)),  # mirrored: u runs to the left, v still down
        ([[0.5, 0], [0, 3]], (1, 0), (0, 1)),  # stretched
    ],
)
def test_red_is_along_u_and_green_upward_in_the_texture(tmp_path, turn, right, up):
    mesh = with_uv(height_field(4), turn)
    for x, y in ((1, 0), (0, 1), (0.6, -0.8), (-1, 0)):
        path = everywhere(tmp_path / "one.png", x, y)
        wanted = x * np.array([*right, 0]) + y * np.array([*up, 0])
        field = direction_field(mesh, path)
        np.testing.assert_allclose(field.face_vectors @ wanted, 1, atol=1e-3)
        np.testing.assert_allclose(requested_at_corners(mesh, parse_direction(path)) @ wanted, 1, atol=1e-3)


def test_a_swirl_is_followed(tmp_path):
    rows, columns = np.mgrid[0:64, 0:64] / 64 + 1 / 128 - 0.5
    radius = np.maximum(np.hypot(rows, columns), 1e-9)
    path = image_of(tmp_path / "swirl.png", np.stack([rows, columns], axis=2) / radius[..., None])
    mesh = with_uv(height_field(40), np.eye(2))
    to = mesh.corners.reshape(-1, 3)[:, :2] - 0.5
    far = np.hypot(*to.T) > 0.1
    wanted = np.column_stack([-to[:, 1], to[:, 0], 0 * to[:, 0]])[far]
    cosine = (direction_field(mesh, path).corner_vectors.reshape(-1, 3)[far] * wanted).sum(axis=1)
    assert (cosine > np.cos(np.radians(2)) * np.linalg.norm(wanted, axis=1)).all()


def test_blue_is_how_much_it_counts(tmp_path):
    strength = np.zeros((8, 8, 1))
    strength[:, :4] = 1.0
    path = image_of(tmp_path / "half.png", np.broadcast_to((0.0, 1.0), (8, 8, 2)), strength)
    mesh = with_uv(height_field(16), np.eye(2))
    asked = np.linalg.norm(requested_at_corners(mesh, parse_direction(path)), axis=2)
    u = mesh.uv[..., 0]
    np.testing.assert_allclose(asked[(u > 0.1) & (u < 0.4)], 1, atol=1e-3)
    assert asked[(u > 0.6) & (u < 0.9)].max() == 0
    weak = image_of(tmp_path / "weak.png", np.broadcast_to((0.0, 1.0), (8, 8, 2)), 0.4)
    np.testing.assert_allclose(
        np.linalg.norm(requested_at_corners(mesh, parse_direction(weak)), axis=2), 0.4, atol=1e-3
    )
    none = image_of(tmp_path / "none.png", np.broadcast_to((0.0, 1.0), (8, 8, 2)), 0.0)
    np.testing.assert_allclose(np.linalg.norm(read_direction_image(none).along, axis=2), 1, atol=1e-3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_the_middle_asks_for_nothing_whatever_its_rounding(tmp_path, dtype):
    along = np.zeros((4, 4, 2))
    along[0, 0] = 1.0, 0.0
    found = read_direction_image(image_of(tmp_path / "one.png", along, dtype=dtype)).along
    assert np.count_nonzero(found.any(axis=2)) == 1


def test_it_repeats_and_is_linear_between_pixels(tmp_path):
    along = np.zeros((2, 4, 2))
    along[:, :2], along[:, 2:] = (1.0, 0.0), (0.0, 1.0)
    found = read_direction_image(image_of(tmp_path / "two.png", along))
    uv = np.array([[0.25, 0.5], [0.5, 0.3], [0.75, 0.2], [1.0, 0.5], [0.0, 1.0], [-0.75, 7.5]])
    wanted = [[1, 0], [0.5, 0.5], [0, 1], [0, 1], [1, 0], [1, 0]]
    np.testing.assert_allclose(found.at(uv), wanted, atol=5e-3)
    np.testing.assert_allclose(found.at(uv[:3] + np.array((3, -2))), wanted[:3], atol=5e-3)


def test_on_patches_it_lies_over_each_face(tmp_path):
    surface = surface_from_spec("plane")
    charted = in_detail(charted_patches(surface, density_layout(surface, density=100.0, largest=1000)))
    assert np.linalg.norm(np.diff(charted.mesh.corners, axis=1), axis=2).max() <= 0.0201 * 2**0.5
    for x, y in ((1, 0), (0, 1), (0.6, 0.8)):
        direction = parse_direction(everywhere(tmp_path / "one.png", x, y), patches=True)
        reported = vectors_on_patches(surface, charted, direction)
        field = direction_field(charted.mesh, reported)
        along = vectors_on_patches(surface, charted, parse_direction("u", patches=True)).vectors[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        wanted = x * along + y * np.cross(charted.mesh.flat_normals, along)
        np.testing.assert_allclose((field.face_vectors * wanted).sum(axis=1), 1, atol=1e-3)


def test_detail_keeps_coordinates_and_places(tmp_path):
    mesh = with_uv(height_field(2), [[0.5, 0.2], [-0.1, 0.7]])
    charted = on_charts(unwrap(mesh)[0], 50.0)
    fine = in_detail(charted)
    assert len(fine.chart) > 1000
    assert fine.mesh.areas.sum() == pytest.approx(mesh.areas.sum())
    flat = fine.mesh.corners[..., :2] - 0.5
    wanted = np.stack([flat[..., 0], -flat[..., 1]], axis=-1) @ np.array([[0.5, 0.2], [-0.1, 0.7]]).T + 0.5
    np.testing.assert_allclose(fine.mesh.uv, wanted, atol=1e-9)
    # What has no coordinates asks for nothing.
    uv = mesh.uv.copy()
    uv[0, 2] = np.nan
    fine = in_detail(charted, uv)
    field = vectors_on_coordinates(fine.mesh, parse_direction(everywhere(tmp_path / "one.png", 1, 0)))
    without = np.linalg.norm(field.vectors, axis=2).max(axis=1) == 0
    first = np.linalg.norm(mesh.corners[0, [1, 2, 1]] - mesh.corners[0, [0, 0, 2]], axis=1).max()
    assert fine.mesh.areas[without].sum() == pytest.approx(mesh.areas[0])
    near = np.linalg.norm(fine.mesh.corners[without].mean(axis=1) - mesh.corners[0].mean(axis=0), axis=1)
    assert near.max() < first


def test_what_asks_for_nothing_is_refused_in_a_line(tmp_path):
    mesh = height_field(2)
    with pytest.raises(InputError, match="no texture coordinates"):
        direction_field(mesh, everywhere(tmp_path / "one.png", 1, 0))
    write_image(tmp_path / "grey.png", np.full((4, 4, 1), 255, np.uint8))
    with pytest.raises(InputError, match="1 channel"):
        parse_direction(str(tmp_path / "grey.png"))
    with pytest.raises(InputError, match="asks for nothing"):
        parse_direction(image_of(tmp_path / "none.png", np.zeros((4, 4, 2))))
    with pytest.raises(InputError, match=r"missing\.png"):
        parse_direction("missing.png")
