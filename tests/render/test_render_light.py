import numpy as np
import pytest

from upholster.model.render._kernels import COVER, DEPTH, FLOOR, LIGHT, NORMAL, SUMS
from upholster.model.render.camera import Camera
from upholster.model.render.light import TILE, averaged, key_direction, occlusion_pattern

AXES = Camera.fit(np.eye(3), view=(30, 20)).axes


@pytest.mark.parametrize("supersample", [1, 2, 3, 8])
def test_pattern_covers_its_lights_evenly(supersample: int) -> None:
    pattern = occlusion_pattern(AXES, supersample).astype(np.float64)
    assert pattern.shape == (TILE**2 * supersample**2, 6)
    key, sky = pattern[:, :3], pattern[:, 3:]
    np.testing.assert_allclose(np.linalg.norm(key, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(sky, axis=1), 1, atol=1e-6)
    assert (key @ key_direction(AXES)).min() > 0.99
    mean = key.mean(axis=0)
    np.testing.assert_allclose(mean / np.linalg.norm(mean), key_direction(AXES), atol=5e-3)
    # Cosine-weighted: the mean of the direction is (0, 0, 2/3).
    np.testing.assert_allclose(sky.mean(axis=0), (0, 0, 2 / 3), atol=0.03)
    assert sky[:, 2].min() > 0


def test_key_light_is_above_the_horizon_in_every_view_from_above() -> None:
    for elevation in range(0, 91, 10):
        assert key_direction(Camera.fit(np.eye(3), view=(0, elevation)).axes)[2] > 0.3


def sums_of_a_flat_wall(rows: int, columns: int) -> np.ndarray:
    sums = np.zeros((rows, columns, SUMS), np.float32)
    sums[..., COVER] = 1
    sums[..., NORMAL] = 1
    sums[..., DEPTH] = 3
    return sums


def test_averaging_takes_a_tile_out() -> None:
    rng = np.random.default_rng(1)
    sums = sums_of_a_flat_wall(4 * TILE, 5 * TILE)
    tile = rng.random((TILE, TILE, SUMS - LIGHT), np.float32)
    sums[..., LIGHT:] = np.tile(tile, (4, 5, 1))
    inner = averaged(sums, 0.01)[:, 4:-4, 4:-4]
    flat = np.broadcast_to(64 * tile.mean(axis=(0, 1))[:, None, None], inner.shape)
    np.testing.assert_allclose(inner, flat, rtol=1e-5)


@pytest.mark.parametrize("what", [NORMAL, DEPTH, COVER])
def test_averaging_stops_at_edges_of_the_model(what: int) -> None:
    sums = sums_of_a_flat_wall(24, 24)
    sums[:, 12:, what] = {NORMAL: -1, DEPTH: 9, COVER: 0}[what]
    sums[:, :12, LIGHT:] = 1
    result = averaged(sums, 0.01)
    model, floor = result[: FLOOR - LIGHT], result[FLOOR - LIGHT :]
    if what == COVER:  # nothing there: nothing to be alike
        sums[:, 12:, NORMAL : NORMAL + 3] = 0
        model = averaged(sums, 0.01)[: FLOOR - LIGHT]
    assert (model[:, :, 12:] == 0).all()
    assert (floor[:, :, 12:15] > 0).all()


def test_averaging_reaches_no_further_than_the_picture() -> None:
    sums = sums_of_a_flat_wall(3, 2)  # smaller than the reach
    sums[..., LIGHT:] = 1
    np.testing.assert_allclose(averaged(sums, 0.01), 6, rtol=1e-6)
