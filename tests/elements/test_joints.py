"""Joints: found where thin lines part elements, nowhere else, at the same places whatever the size."""

import numpy as np
import pytest

from upholster.image.elements.joints import find_joints


def noise(shape, seed):
    return np.random.default_rng(seed).normal(0, 1, shape)


def stones(side=256, cells=40, *, dark=True, width=2.0, seed=1):
    """Stones round random points, with joints `width` pixels to either side of their borders."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, side, (cells, 2))
    rows, columns = np.mgrid[:side, :side]
    away = np.sort(np.hypot(rows[..., None] - points[:, 0], columns[..., None] - points[:, 1]), axis=2)
    edge = away[..., 1] - away[..., 0]
    nearest = np.hypot(rows[..., None] - points[:, 0], columns[..., None] - points[:, 1]).argmin(axis=2)
    shade = rng.uniform(110, 150, cells)[nearest] + noise((side, side), seed) * 6
    image = np.where(edge < 2 * width, 60 if dark else 200, shade)
    return np.clip(image, 0, 255).astype(np.uint8)[..., None].repeat(3, axis=2), edge


@pytest.mark.parametrize("dark", [True, False])
def test_joints_of_stones_are_found(dark):
    image, edge = stones(dark=dark)
    joints = find_joints(image)
    assert joints is not None
    near = joints.distances < 64
    assert near[edge < 2].mean() > 0.8
    assert joints.distances[edge > 20].mean() > 160


def test_the_middle_of_stones_is_as_far_as_it_gets():
    joints = find_joints(stones()[0])
    assert joints.distances.max() == 255
    assert 0.05 < (joints.distances == 255).mean() < 0.2


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_any_grain_has_no_joints(seed):
    grain = noise((300, 260), seed)
    for _ in range(3 * seed):
        grain = (grain + np.roll(grain, 1, 0) + np.roll(grain, 1, 1) + np.roll(grain, (1, 1), (0, 1))) / 4
    image = np.clip(128 + 40 * grain / grain.std(), 0, 255).astype(np.uint8)
    assert find_joints(image[..., None]) is None


def test_what_has_one_colour_has_no_joints():
    assert find_joints(np.full((64, 64, 3), 77, np.uint8)) is None
    assert find_joints(stones(side=24, cells=4)[0]) is None  # too small to tell


@pytest.mark.parametrize("dtype", ["uint16", "float32"])
def test_kinds_of_samples_do_not_count(dtype):
    image = stones()[0]
    other = image.astype(dtype) * 257 if dtype == "uint16" else image.astype(np.float32) / 255
    one, same = find_joints(image), find_joints(other)
    assert same is not None
    assert np.abs(one.distances.astype(int) - same.distances).mean() < 1


def test_the_same_joints_are_found_at_twice_the_size():
    image = stones(side=256)[0]
    large = image.repeat(2, axis=0).repeat(2, axis=1)
    one, same = find_joints(image), find_joints(large)
    assert same is not None
    assert np.abs(one.distances.astype(int) - same.distances[::2, ::2]).mean() < 25


def test_stones_in_a_row_are_counted():
    rows, columns = np.mgrid[:240, :240]
    for across in (3, 5, 8):
        side = 240 / across
        joint = np.minimum((rows + side / 2) % side, (columns + side / 2) % side) < 4
        image = np.where(joint, 60, 130) + np.random.default_rng(1).normal(0, 4, (240, 240))
        joints = find_joints(np.clip(image, 0, 255).astype(np.uint8)[..., None])
        assert joints.across == pytest.approx(across, abs=0.6)
