"""What a ray hits first, against a triangle at a time."""

import numpy as np
import pytest

from upholster import InputError
from upholster.geometry.meshes.rays import first_hit


def _plain(corners: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> float:
    """Return how far along the ray a triangle is hit, infinite where it is not: by three linear equations."""
    a, b, c = corners
    try:
        u, v, distance = np.linalg.solve(np.stack([b - a, c - a, -direction], axis=1), origin - a)
    except np.linalg.LinAlgError:
        return np.inf
    return float(distance) if u >= 0 and v >= 0 and u + v <= 1 and distance > 0 else np.inf


def test_the_nearest_triangle_is_hit() -> None:
    rng = np.random.default_rng(0)
    positions, triangles = rng.normal(size=(60, 3)), rng.integers(60, size=(80, 3))
    hits = 0
    for _ in range(200):
        origin, direction = 2 * rng.normal(size=3), rng.normal(size=3)
        distances = [_plain(positions[one], origin, direction) for one in triangles]
        found = first_hit(positions, triangles, origin, direction)
        if found is None:
            assert np.isinf(min(distances))
            continue
        hits += 1
        assert distances[found[0]] == pytest.approx(min(distances))
        np.testing.assert_allclose(found[1], origin + min(distances) * direction)
    assert 20 < hits < 180


@pytest.mark.parametrize("ray", [([0.0, 0.0], [0.0, 0.0, 1.0]), ([0.0, 0.0, 0.0], [0.0, np.nan, 1.0])])
def test_a_ray_is_three_finite_numbers_each(ray: tuple[list[float], list[float]]) -> None:
    with pytest.raises(InputError, match="three finite numbers"):
        first_hit(np.eye(3), np.array([[0, 1, 2]]), np.array(ray[0]), np.array(ray[1]))
