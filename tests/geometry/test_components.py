"""Connected components, against a plain search."""

import numpy as np
import pytest

from upholster.geometry.components import connected


@pytest.mark.parametrize("pairs", [0, 5, 30, 200])
def test_each_item_has_the_lowest_item_connected_to_it(pairs: int) -> None:
    given = np.random.default_rng(pairs).integers(0, 60, (pairs, 2))
    beside = {n: {n} for n in range(60)}
    for a, b in given.tolist():
        beside[a].add(b)
        beside[b].add(a)
    lowest = []
    for n in range(60):
        seen, ahead = {n}, [n]
        while ahead:
            ahead += (new := beside[ahead.pop()] - seen)
            seen |= new
        lowest.append(min(seen))
    assert connected(60, given).tolist() == lowest


def test_a_long_chain_in_any_order_is_one_component() -> None:
    order = np.random.default_rng(1).permutation(10_000)
    assert not connected(10_000, np.stack([order[1:], order[:-1]], axis=1)).any()
