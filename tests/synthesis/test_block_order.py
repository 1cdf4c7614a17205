"""The order of blocks: what is near, how far along the surface, and what can be laid in parallel."""

import numpy as np
import pytest

from upholster.synthesis.quilt.block_order import distances_from, near_blocks, ranks_of


def grid(rows: int, columns: int, step: float = 1.0) -> np.ndarray:
    """Return the points of a flat grid, row after row."""
    y, x = np.mgrid[:rows, :columns]
    return step * np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)


@pytest.mark.parametrize("first", [0, 40])
@pytest.mark.parametrize("tile", [None, (3.0, 2.0, 0.0), (0.7, 5.0, 1.0)])
def test_near_blocks_are_all_within_reach(tile: tuple[float, ...] | None, first: int) -> None:
    extent = np.array((4.0, 3.0, 2.0) if tile is None else tile)
    spots = np.random.default_rng(3).random((120, 3)) * extent
    box = None if tile is None else np.stack([0 * extent, extent])
    found = near_blocks(spots, 0.6, box, first=first)
    apart = np.abs(spots[:, None] - spots)
    if tile is not None:
        apart = np.minimum(apart, np.where(extent > 0, extent, np.inf) - apart)
    lengths = np.sqrt((apart**2).sum(axis=2))
    wanted = (lengths < 0.6) & ~np.eye(120, dtype=bool)
    wanted[:first] = False
    listed = np.zeros_like(wanted)
    listed[found.owners, found.others] = True
    np.testing.assert_array_equal(listed, wanted)
    assert len(found.others) == wanted.sum()  # none twice
    np.testing.assert_allclose(found.lengths, lengths[found.owners, found.others])


def test_distances_grow_from_one_end_and_backs_are_far() -> None:
    # A strip that is folded back: its two halves are close in space, and far along the surface.
    there, back = grid(3, 30), grid(3, 30) + np.array([0, 0, 1])
    bend = np.array([[30.0, y, 0.5] for y in range(3)])
    spots = np.concatenate([there, bend, back])
    normals = np.concatenate(
        [np.tile([0, 0, -1.0], (90, 1)), np.tile([1.0, 0, 0], (3, 1)), np.tile([0, 0, 1.0], (90, 1))]
    )
    near = near_blocks(spots, 1.6)
    away = distances_from(near, normals, np.full(len(spots), np.inf))
    assert np.ptp(away) > 55
    ends = away.argmin(), away.argmax()
    assert {spots[n, 0] for n in ends} == {0.0}
    assert spots[ends[0], 2] != spots[ends[1], 2]
    # From what is laid: as far as the shortest way.
    known = np.full(len(spots), np.inf)
    known[45] = 0.0
    away = distances_from(near, normals, known)
    assert away[45] == 0
    assert away[46] == 1


def test_each_part_has_its_own_end() -> None:
    spots = np.concatenate([grid(4, 9), grid(4, 9) + np.array([100, 0, 0])])
    away = distances_from(near_blocks(spots, 1.6), np.tile([0, 0, 1.0], (72, 1)), np.full(72, np.inf))
    assert np.isfinite(away).all()
    assert away[:36].min() == away[36:].min() == 0
    np.testing.assert_array_equal(away[:36], away[36:])


def test_blocks_of_a_rank_are_not_near_and_wait_for_all_earlier_ones() -> None:
    spots, rng = grid(9, 12), np.random.default_rng(5)
    near, first = near_blocks(spots, 2.1, first=20), 20
    order = rng.permutation(len(spots) - first)
    ranks = ranks_of(near, first, order)
    names = np.concatenate([np.arange(first), first + np.argsort(np.lexsort((np.argsort(order), ranks)))])
    firsts, others = near.earlier(names, first)
    place = np.argsort(order)
    for one, other in zip(near.owners - first, near.others - first, strict=True):
        if other < 0:
            continue
        assert ranks[one] != ranks[other]
        assert (ranks[other] < ranks[one]) == (place[other] < place[one])
    lists = {n: set(others[firsts[n] : firsts[n + 1]].tolist()) for n in range(len(spots))}
    assert not any(lists[n] for n in range(first))
    for one, other in zip(near.owners, near.others, strict=True):
        assert (names[other] in lists[names[one]]) == (names[other] < names[one])
