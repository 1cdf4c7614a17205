"""The layout of coefficients: each once, in one tree, with neighbours that need no bounds checks."""

import numpy as np
import pytest

from upholster.codec.tree import (
    ACROSS,
    ALONG,
    BAND,
    CHANNEL_STEP,
    CHILD,
    CHILD_STEP,
    COUSIN_A,
    COUSIN_B,
    HL,
    KIND,
    LH,
    LL,
    PADDING,
    PARENT,
    build_tree,
)

SHAPES = [
    (1, 1, 1, 0),
    (1, 1, 2, 3),
    (8, 8, 1, 3),
    (7, 5, 3, 2),
    (13, 22, 2, 4),
    (1, 30, 1, 5),
    (64, 33, 3, 6),
]
each = pytest.mark.parametrize(("height", "width", "channels", "levels"), SHAPES)


def children(tree, i):
    """The children of place i, as `upholster.codec._coder_kernels` finds them."""
    first, band = tree.links[CHILD, i], tree.table[tree.links[BAND, i]]
    if first == 0:
        return []
    step = band[CHILD_STEP]
    steps = [0, step, 2 * step] if band[KIND] == LL else [0, 1, step, step + 1]
    return [int(first + s) for s in steps if tree.flags[first + s] != PADDING]


@each
def test_every_coefficient_has_one_place(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    places = np.concatenate([tree.places(band).reshape(-1) for band in tree.bands])
    assert len(places) == len(np.unique(places)) == height * width * channels
    np.testing.assert_array_equal(np.sort(places), np.flatnonzero(tree.flags != PADDING))
    assert 0 not in places  # which means "none"


@each
def test_every_coefficient_is_in_exactly_one_tree(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    seen = np.zeros(tree.size, int)
    line = [int(i) for i in tree.roots]
    for i in line:
        seen[i] += 1
        line += children(tree, i)
    np.testing.assert_array_equal(seen, tree.flags != PADDING)


@each
def test_parents_and_children_agree(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    roots = set(tree.roots.tolist())
    for i in np.flatnonzero(tree.flags != PADDING):
        for child in children(tree, i):
            assert tree.links[PARENT, child] == i
            assert child not in roots
        parent = tree.links[PARENT, i]
        assert (parent == 0) == (int(i) in roots)
        if parent:
            assert int(i) in children(tree, parent)


@each
def test_children_lie_at_twice_their_parents_place_in_the_same_band(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    where = {}
    for band in tree.bands:
        places = tree.places(band)
        for (row, column), place in np.ndenumerate(places):
            where[int(place)] = (band, row, column)
    for band, row, column in list(where.values()):
        for child in children(tree, int(band.start + row * band.stride + column)):
            other, below, right = where[child]
            assert other.channel == band.channel
            if band.kind == LL:
                assert (other.level, below, right) == (band.level, row, column)
            else:
                assert (other.level, other.kind) == (band.level - 1, band.kind)
                assert (below // 2, right // 2) == (row, column)


@each
def test_neighbours_cousins_and_channels_need_no_bounds_checks(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    bands = {(band.channel, band.level, band.kind): band for band in tree.bands}
    for number, band in enumerate(tree.bands):
        table, places = tree.table[number], tree.places(band)
        assert {table[ALONG], table[ACROSS]} == {1, band.stride}
        assert (table[ALONG] == 1) == (band.kind != LH)
        if band.kind == HL:
            assert table[ALONG] == 1  # high-pass from column to column
        inside = set(places.reshape(-1).tolist())
        for row in range(-2, 3):
            for column in range(-2, 3):
                near = places + row * band.stride + column
                assert near.size == 0 or (near.min() >= 0 and near.max() < tree.size)
                if abs(row) + abs(column) <= 2:
                    # Beyond the band lies padding, not another band: two columns serve both sides.
                    beyond = [i for i in near.reshape(-1).tolist() if i not in inside]
                    assert (tree.flags[beyond] == PADDING).all()
        if band.kind != LL and places.size:
            for step in (table[COUSIN_A], table[COUSIN_B]):
                assert places.min() + step >= 0
                assert places.max() + step < tree.size
                sibling = next(
                    n for n, other in enumerate(tree.bands) if other.begin <= places[0, 0] + step < other.end
                )
                other = tree.bands[sibling]
                assert (other.channel, other.level) == (band.channel, band.level)
                assert other.kind not in (LL, band.kind)
                assert places[0, 0] + step == other.start
        if band.channel > 0:
            before = bands[band.channel - 1, band.level, band.kind]
            np.testing.assert_array_equal(places - table[CHANNEL_STEP], tree.places(before))


@each
def test_segments_hold_everything_from_coarse_to_fine(height, width, channels, levels):
    tree = build_tree(height, width, channels, levels)
    levels_seen, covered = [], np.zeros(tree.size, int)
    for begin, end in tree.segments:
        band = next(band for band in tree.bands if (band.begin, band.end) == (begin, end))
        levels_seen.append(band.level)
        covered[begin:end] += 1
    assert levels_seen == sorted(levels_seen, reverse=True)
    assert covered.max() == 1
    assert covered[tree.flags != PADDING].all()


def test_arrays_do_not_change():
    tree = build_tree(8, 8, 1, 2)
    for array in (tree.links, tree.table, tree.segments, tree.roots, tree.flags):
        assert not array.flags.writeable
