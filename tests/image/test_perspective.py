"""Corners of a rectangle on a wall are found in a photo that was taken at an angle."""

import numpy as np
import pytest

from upholster.base.types import FloatArray, PixelArray
from upholster.image.photo.perspective import proposed_corners

WIDTH, HEIGHT = 640, 480


def camera(tilt: float, turn: float, roll: float) -> FloatArray:
    """Return the map from a wall, 1 away, to a photo whose middle sees (0, 0); angles in degrees."""
    a, b, c = np.radians([tilt, turn, roll])
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    turned = about_z @ about_x @ about_y
    lens = np.array([[0.72 * WIDTH, 0, WIDTH / 2], [0, 0.72 * WIDTH, HEIGHT / 2], [0, 0, 1]])
    found: FloatArray = lens @ np.stack([turned[:, 0], turned[:, 1], [0, 0, 1]], axis=1)
    return found


def tiles(seen: FloatArray, seed: int) -> PixelArray:
    """Return a photo of tiles of different greys with light joints and noise."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    wall = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(seen).T
    place = wall[..., :2] / wall[..., 2:] * 6
    greys = rng.uniform(60, 140, (64, 64))
    column, row = np.floor(place).astype(int).T % 64
    joint = (np.abs(place - np.round(place)) < 0.06).any(axis=-1)
    photo = np.where(joint, 200, greys[row, column].T) + rng.normal(0, 12, joint.shape)
    return np.clip(photo, 0, 255).astype(np.uint8)[:, :, None]


@pytest.mark.slow(reason="large photographs")
@pytest.mark.parametrize("angles", [(15, 0, 0), (0, -20, 3), (-14, 17, -5), (10, 8, 6)])
def test_the_sides_of_what_is_proposed_run_along_the_joints(angles: tuple[float, float, float]) -> None:
    seen = camera(*angles)
    found = proposed_corners(tiles(seen, 1))
    assert found is not None
    corners = np.array(found)
    assert ((corners >= 0) & (corners <= [WIDTH, HEIGHT])).all()
    wall = np.append(corners, np.ones((4, 1)), axis=1) @ np.linalg.inv(seen).T
    sides = np.roll(wall[:, :2] / wall[:, 2:], -1, axis=0) - wall[:, :2] / wall[:, 2:]
    turned = np.degrees(np.arctan2(sides[:, 1], sides[:, 0])) - [0, 90, 180, 270]
    assert np.abs((turned + 180) % 360 - 180).max() < 1
    across, down = corners[2] - corners[0], corners[3] - corners[1]
    area = abs(across[0] * down[1] - across[1] * down[0]) / 2
    assert area > 0.4 * WIDTH * HEIGHT


@pytest.mark.slow(reason="large photographs")
def test_nothing_is_proposed_where_nothing_is_sure() -> None:
    rng = np.random.default_rng(2)
    assert proposed_corners(tiles(camera(0, 0, 0), 1)) is None  # seen from the front
    assert proposed_corners(rng.integers(0, 256, (300, 400, 3), np.uint8)) is None
    assert proposed_corners(np.full((300, 400, 3), 90, np.uint8)) is None
    assert proposed_corners(tiles(camera(15, 0, 0), 1)[:60, :60]) is None


@pytest.mark.slow(reason="large photographs")
def test_depth_and_channels_make_little_difference() -> None:
    photo = tiles(camera(10, -12, 2), 3)
    one = np.array(proposed_corners(photo))
    deep = np.repeat(photo.astype(np.uint16) * 257, 3, axis=2)
    np.testing.assert_allclose(np.array(proposed_corners(deep)), one, atol=1e-6)


def test_a_slanted_pattern_is_no_perspective() -> None:
    """Rows of hexagons run at 60 degrees: parallel lines, seen from the front."""
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    place = np.stack([x - y / np.tan(np.radians(60)), y / np.sin(np.radians(60))]) / 50
    joint = (np.abs(place - np.round(place)) < 0.06).any(axis=0)
    photo = np.where(joint, 200, 100) + rng.normal(0, 12, joint.shape)
    assert proposed_corners(np.clip(photo, 0, 255).astype(np.uint8)[:, :, None]) is None
