"""Rectifying: a camera made here looks at a rectangle, and the rectangle comes back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.base.options.sample_options import SampleOptions
from upholster.image.color import from_linear, to_linear
from upholster.image.files.material import Material
from upholster.image.files.material_files import read_material
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import write_image
from upholster.image.photo.preparation import cut_out
from upholster.image.photo.rectify import Rectification

WIDTH, HEIGHT = 640, 480


def seen(
    ratio: float, pan: float, tilt: float, *, focal: float = 0.8, roll: float = 0.0, away: float = 3.0
) -> Any:
    """Return where a camera sees the corners of a rectangle 2·ratio wide and 2 high, turned by degrees."""
    a, b, c = np.radians([pan, tilt, roll])
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    corners = np.array([(-ratio, -1, 0), (ratio, -1, 0), (ratio, 1, 0), (-ratio, 1, 0)])
    points = corners @ (about_z @ about_x @ about_y).T + [0.1, -0.05, away * max(1, ratio)]
    places = focal * WIDTH * points[:, :2] / points[:, 2:] + [WIDTH / 2, HEIGHT / 2]
    return tuple((float(x), float(y)) for x, y in places)


def smooth(height: int, width: int, channels: int = 3) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width] + 0.5
    planes = [0.5 + 0.4 * np.sin(x / (9 + k) + k) * np.cos(y / (7 + k)) for k in range(channels)]
    return np.stack(planes, axis=2).astype(np.float32)


# Which rectangle


@pytest.mark.parametrize("ratio", [1.0, 1.6, 0.5])
@pytest.mark.parametrize("focal", [0.7, 1.0, 1.8])
@pytest.mark.parametrize("pan", [-25, 15])
def test_the_ratio_is_that_of_the_rectangle(ratio: float, focal: float, pan: float) -> None:
    """Tilted about both axes, the corners tell the focal length as well."""
    found = Rectification(seen(ratio, pan, 20, focal=focal, away=2.5 * focal + 1), WIDTH, HEIGHT)
    assert found.width / found.height == pytest.approx(ratio, rel=0.02)


@pytest.mark.parametrize(("focal", "most"), [(0.67, 0.02), (0.72, 0.01), (0.78, 0.02), (1.2, 0.1)])
def test_tilted_about_one_axis_a_phone_is_assumed(focal: float, most: float) -> None:
    """Mean side lengths would be off by 1 − cos 30°, 13 %."""
    found = Rectification(seen(1.0, 0, 30, focal=focal, away=4 * focal + 1), WIDTH, HEIGHT)
    assert found.width / found.height == pytest.approx(1.0, abs=most)


def test_from_the_front_sides_are_kept() -> None:
    found = Rectification(((40, 30), (400, 30), (400, 210), (40, 210)), WIDTH, HEIGHT)
    assert (found.width, found.height) == (360, 180)


def test_corners_are_where_they_were_given() -> None:
    corners = seen(1.3, 20, -15, roll=10)
    found = Rectification(corners, WIDTH, HEIGHT)
    w, h = found.width, found.height
    places = np.array([(0, 0, 1), (w, 0, 1), (w, h, 1), (0, h, 1)]) @ found.matrix.T
    np.testing.assert_allclose(places[:, :2] / places[:, 2:], corners, atol=1e-9)


# Which pixels


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_the_whole_photo_is_itself(dtype: Any) -> None:
    pixels = np.random.default_rng(2).integers(0, 255, (48, 64, 3)).astype(dtype)
    whole = SampleOptions(rectify=((0, 0), (64, 0), (64, 48), (0, 48)))
    np.testing.assert_allclose(cut_out({"albedo": pixels}, whole)["albedo"], pixels, rtol=1e-5)


def test_the_first_corner_says_what_is_up() -> None:
    pixels = np.random.default_rng(2).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    turned = SampleOptions(rectify=((64, 0), (64, 48), (0, 48), (0, 0)))
    np.testing.assert_array_equal(cut_out({"albedo": pixels}, turned)["albedo"], np.rot90(pixels))


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_a_function_of_the_wall_is_found_again(channels: int) -> None:
    """Photo: a smooth function of places on the wall. Result: the function itself."""
    found = Rectification(seen(1.2, 25, 15, roll=5), WIDTH, HEIGHT)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    wall = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(found.matrix).T
    wall = wall[..., :2] / wall[..., 2:]

    def at(places: Any) -> Any:
        k = np.arange(channels)
        return 0.5 + 0.4 * np.sin(places[..., :1] / (8 + k)) * np.cos(places[..., 1:] / (9 + k))

    result = found.apply(at(wall).astype(np.float32))
    x, y = np.meshgrid(np.arange(found.width) + 0.5, np.arange(found.height) + 0.5)
    expected = at(np.stack([x, y], axis=-1))
    error = np.abs(result - expected)[3:-3, 3:-3]
    assert error.max() < 0.03
    assert error.mean() < 0.006


def test_nothing_aliases() -> None:
    """Stripes that the near end of the photo has, and the result has not the pixels for, become grey."""
    corners = ((250, 100), (390, 100), (630, 470), (10, 470))
    stripes = np.zeros((HEIGHT, WIDTH, 1), np.uint8)
    stripes[:, ::2] = 255
    result = Rectification(corners, WIDTH, HEIGHT).apply(stripes)
    assert np.abs(result[-60:, 20:-20] - 0.5).max() < 0.06


def test_alpha_weights_colours() -> None:
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    pixels[:, :300] = (200, 100, 50, 255)
    pixels[:, 300:] = (0, 255, 0, 0)
    result = cut_out({"albedo": pixels}, SampleOptions(rectify=seen(1.2, 25, 15)))["albedo"]
    shown = result[result[:, :, 3] > 8][:, :3].astype(int)
    assert len(shown) > 1000
    assert np.abs(shown - [200, 100, 50]).max() <= 2


def test_tiles_and_threads_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = from_linear(smooth(HEIGHT, WIDTH), np.uint8)
    whole = Rectification(seen(1.2, 25, 15), WIDTH, HEIGHT).apply(pixels)
    monkeypatch.setattr("upholster.image.photo.rectify._TILE", 37)
    np.testing.assert_array_equal(Rectification(seen(1.2, 25, 15), WIDTH, HEIGHT).apply(pixels), whole)


# Materials


def relief(height: int, width: int) -> Any:
    y, x = np.mgrid[0:height, 0:width] + 0.5
    return 6 * np.sin(x / 23) * np.cos(y / 17) + 2 * np.sin((x + y) / 11)


def normals(heights: Any) -> Any:
    down, right = np.gradient(heights)
    vectors = np.stack([-right, down, np.ones_like(right)], axis=2)
    return vectors / np.linalg.norm(vectors, axis=2, keepdims=True)


@pytest.mark.parametrize("roll", [0, 30, 90])
def test_normals_are_those_of_the_rectified_relief(roll: float) -> None:
    """They come out as if the heights had been rectified and the normals made of them."""
    heights = relief(HEIGHT, WIDTH)
    corners = seen(1.0, 12, 9, roll=roll, away=4)
    found = Rectification(corners, WIDTH, HEIGHT)
    maps = {
        "albedo": np.zeros((HEIGHT, WIDTH, 1), np.float32),
        "normal": ((normals(heights) + 1) / 2).astype(np.float32),
    }
    turned = 2 * cut_out(maps, SampleOptions(rectify=corners))["normal"] - 1
    scale = np.sqrt(np.linalg.det(found.derivative()).mean())
    expected = normals(found.apply((heights + 20).astype(np.float32)[:, :, None])[:, :, 0] / scale)
    angle = np.degrees(np.arccos(np.clip((turned * expected).sum(axis=2), -1, 1)))
    assert angle[4:-4, 4:-4].max() < 3
    assert angle[4:-4, 4:-4].mean() < 0.5
    np.testing.assert_allclose(np.linalg.norm(turned, axis=2), 1, atol=1e-5)


def test_all_maps_are_rectified_alike(tmp_path: Path) -> None:
    picture = from_linear(smooth(HEIGHT, WIDTH, 1), np.uint8)
    for role in ("albedo", "emission", "height"):
        write_image(tmp_path / f"wall_{role}.png", picture)
    corners = seen(1.2, 25, 15)
    maps = read_material(tmp_path, rectify=corners, crop=(10, 20, 100, 120)).maps
    assert isinstance(read_material(tmp_path), Material)
    np.testing.assert_array_equal(maps["albedo"], maps["emission"])
    assert maps["height"].shape == (120, 100, 1)
    # A height is a number: it passes through no curve, and so differs a little where it changes quickly.
    assert np.abs(maps["height"].astype(int) - maps["albedo"]).max() < 12


# Bad input


def refused(tmp_path: Path, corners: Any, **options: Any) -> str:
    write_image(tmp_path / "x.png", np.zeros((100, 200, 3), np.uint8))
    with pytest.raises(InputError) as caught:
        read_exemplar(tmp_path / "x.png", rectify=corners, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        (((-1, 0), (100, 0), (100, 90), (0, 90)), "the corner -1,0; allowed: inside 200x100"),
        (((0, 0), (201, 0), (100, 90), (0, 90)), "the corner 201,0"),
        (((0, 0), (float("nan"), 0), (100, 90), (0, 90)), "the corner nan,0"),
        (((0, 0), (float("inf"), 0), (100, 90), (0, 90)), "the corner inf,0"),
        (((0, 0), (0, 90), (100, 90), (100, 0)), "runs counterclockwise"),
        (((0, 0), (100, 90), (100, 0), (0, 90)), "no convex quadrilateral"),
        (((0, 0), (100, 0), (20, 20), (0, 90)), "no convex quadrilateral"),
        (((0, 0), (50, 0), (100, 0), (0, 90)), "no convex quadrilateral"),
        (((5, 5), (5, 5), (5, 5), (5, 5)), "no convex quadrilateral"),
        (((0, 0), (100, 0), (100, 90)), "allowed: x,y of top left"),
        ("corners", "allowed: x,y of top left"),
        (((98, 0), (102, 0), (200, 100), (0, 100)), "too steeply"),
        (((0, 0), (30, 0), (30, 90), (0, 90)), "allowed: 32x32 or more"),
        (((0, 0), (100, 0), (100, 2), (0, 2)), "allowed: 32x32 or more"),
    ],
)
def test_corners_that_are_no_rectangle_are_refused(tmp_path: Path, corners: Any, said: str) -> None:
    assert said in refused(tmp_path, corners)


def test_a_crop_is_inside_the_rectangle(tmp_path: Path) -> None:
    corners = ((20, 10), (120, 10), (120, 90), (20, 90))
    assert "inside 100x80" in refused(tmp_path, corners, crop=(0, 0, 101, 80))
    pixels = read_exemplar(tmp_path / "x.png", rectify=corners, crop=(0, 0, 100, 80), resize="50x64")
    assert pixels.shape == (64, 50, 3)
    assert (to_linear(pixels) == 0).all()
