import numpy as np
import pytest

from upholster.geometry.components import components


def plain(pairs: np.ndarray, count: int) -> list[int]:
    """Give both items of each pair the lower number, again and again."""
    lowest = list(range(count))
    for _ in range(count):
        for a, b in pairs.tolist():
            lowest[a] = lowest[b] = min(lowest[a], lowest[b])
    return lowest


@pytest.mark.parametrize("pairs", [0, 10, 40, 60, 200])
def test_random_items_are_connected(pairs: int) -> None:
    for seed in range(5):
        some = np.random.default_rng(seed).integers(0, 60, (pairs, 2))
        assert components(some, 60).tolist() == plain(some, 60)


def test_a_long_chain_in_any_order_is_one_component() -> None:
    order = np.random.default_rng(1).permutation(10_000)
    assert not components(np.stack([order[1:], order[:-1]], axis=1), 10_000).any()
