import math

import numpy as np
import pytest
from render_shapes import sheet, sphere

from upholster.base.errors import InputError
from upholster.model.render.camera import FILL, Camera
from upholster.model.render.picture import render


@pytest.mark.parametrize("view", [(0, 0), (30, 30), (-200, -45), (90, 90), (12, -90), (1e6, 10)])
@pytest.mark.parametrize("size", [(64, 48), (30, 90), (200, 20)])
def test_model_is_centred_and_fills_the_tighter_side(
    view: tuple[float, float], size: tuple[int, int]
) -> None:
    points = np.random.default_rng(1).normal(size=(500, 3)) * (3, 1, 0.4) + (100, -20, 7)
    x, y, depth = Camera.fit(points, size=size, view=view).project(points).T
    assert depth.min() > 0
    fill = np.ptp(x) / size[0], np.ptp(y) / size[1]
    assert max(fill) == pytest.approx(FILL)
    tight = int(np.argmax(fill))
    assert (x.min() + x.max(), y.min() + y.max())[tight] == pytest.approx(size[tight])


def test_axes_follow_the_conventions() -> None:
    points = sphere()[0]
    front, side, top = (Camera.fit(points, view=view) for view in ((0, 0), (90, 0), (0, 90)))
    np.testing.assert_allclose(front.axes, [[1, 0, 0], [0, 0, 1], [0, 1, 0]], atol=1e-15)
    assert front.eye[1] < -1  # looks from -y toward +y
    assert side.eye[0] > 1  # counter-clockwise seen from above
    np.testing.assert_allclose(top.axes, [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-15)
    for camera in (front, side, top):
        np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(np.cross(camera.axes[0], camera.axes[1]), -camera.axes[2], atol=1e-15)


def test_vertical_field_of_view_is_30_degrees() -> None:
    camera = Camera.fit(sphere()[0], size=(400, 300))
    assert 2 * math.atan(150 / camera.focal) == pytest.approx(math.radians(30))


def test_zoom_enlarges_about_the_target_and_keeps_the_distance() -> None:
    points, target = sphere()[0], np.array([0.3, -0.2, 0.8])
    plain, near = (Camera.fit(points, view=(20, 10), zoom=zoom, target=target) for zoom in (1, 4))
    np.testing.assert_array_equal(plain.eye, near.eye)
    for camera in (plain, near):
        np.testing.assert_allclose(camera.project(target)[:2], (512, 384))
    moved = target + 0.05
    offset = plain.project(moved)[:2] - (512, 384)
    np.testing.assert_allclose(near.project(moved)[:2] - (512, 384), 4 * offset)


def test_directions_and_project_are_inverse() -> None:
    camera = Camera.fit(sphere()[0] * 5 + 9, size=(37, 53), view=(33, -21), zoom=2)
    pixels = np.random.default_rng(2).uniform(-10, 60, (100, 2))
    depth = np.linspace(0.1, 50, 100)
    points = camera.eye + depth[:, None] * camera.directions(pixels[:, 0], pixels[:, 1])
    np.testing.assert_allclose(camera.project(points), np.column_stack([pixels, depth]), rtol=1e-10)


def test_points_behind_the_eye_have_no_place() -> None:
    camera = Camera.fit(sphere()[0])
    behind = camera.project(camera.eye - camera.axes[2])
    assert np.isnan(behind[:2]).all()
    assert behind[2] == pytest.approx(-1)


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (np.zeros((3, 3)), {}, "more than one place"),
        (np.zeros((0, 3)), {}, "shape"),
        (np.full((3, 3), np.nan), {}, "finite"),
        (np.array([[-1e308, 0, 0], [1e308, 0, 0]]), {}, "finite"),
        (np.eye(3), {"size": (0, 5)}, "size"),
        (np.eye(3), {"size": (16385, 5)}, "16384"),
        (np.eye(3), {"size": (10.5, 5)}, "size"),
        (np.eye(3), {"view": (math.nan, 0)}, "view"),
        (np.eye(3), {"view": (0, 90.5)}, "elevation"),
        (np.eye(3), {"view": (0, 1, 2)}, "view"),
        (np.eye(3), {"zoom": 0}, "zoom"),
        (np.eye(3), {"zoom": math.nan}, "zoom"),
        (np.eye(3), {"target": (0, 1)}, "target"),
        (np.eye(3), {"target": (0, 1, math.inf)}, "target"),
    ],
)
def test_bad_input_is_one_line(points: np.ndarray, options: dict[str, object], message: str) -> None:
    with np.errstate(over="ignore"), pytest.raises(InputError, match=message) as caught:
        Camera.fit(points, **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_project_agrees_with_the_picture() -> None:
    """A dot on the texture appears where `project` says."""
    texture = np.zeros((64, 64, 3), np.float32)
    texture[20:22, 44:46] = 1.0
    model = sheet(2.0, 1.5)
    camera = Camera.fit(model[0], size=(200, 160), view=(25, 20))
    image = render(*model, texture, camera=camera, background=(0, 0, 0), shadows=False, max_level=0)
    weight = np.maximum(image[..., 0] - 0.05, 0)  # without the sheen
    y, x = (np.indices(weight.shape) + 0.5) * weight / weight.sum()
    dot = np.array([2.0 * (45 / 64 - 0.5), 0, 1.5 * (0.5 - 21 / 64)])
    np.testing.assert_allclose((x.sum(), y.sum()), camera.project(dot)[:2], atol=0.1)
