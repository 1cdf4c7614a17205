"""The layout of coefficients in the coder's memory, and the tree that each belongs to.

Every band of every channel is a region of one flat array, padded with two columns on its right and two rows
above and below, so that neighbours need no bounds checks: padding is never significant. The three detail
bands of a level have regions of one size, so that the same position in a sibling band, or in another channel,
is at a fixed distance. A coefficient's children are the (up to) four of the same band, one level finer, at
twice its position; those of the approximation are the three detail coefficients at its own position. A
coefficient without a parent is a root.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import frozen_array
from upholster.codec.haar import level_shape

__all__ = ["HH", "HL", "LH", "LL", "PADDING", "Band", "Tree", "build_tree", "tree_size"]

# Rows of the coder's memory: links, known part of the magnitude, flags, highest plane plus one at which a
# descendant became significant, the queues of the likely pass as linked lists, and the current queue.
PARENT, CHILD, BAND, KNOWN, FLAGS, BELOW, FOLLOWING, PRECEDING, WAITING = range(9)
# The line of the dominant pass reuses the memory of the queues, which are empty when it forms.
LINE = FOLLOWING
# Columns of `Tree.table`.
KIND, LEVEL, CHANNEL, ALONG, ACROSS, COUSIN_A, COUSIN_B, CHILD_STEP, LOWEST, CHANNEL_STEP = range(10)

LL, HL, LH, HH = 0, 1, 2, 3

PADDING = 128
"""Flag of a place that holds no coefficient."""


class Band(NamedTuple):
    """One band of one channel: rows × columns coefficients, the first at `start`, rows `stride` apart."""

    channel: int
    level: int
    kind: int
    rows: int
    columns: int
    start: int
    stride: int
    begin: int
    end: int


@dataclass(frozen=True)
class Tree:
    """The coder's memory for one shape of image.

    Attributes
    ----------
    bands
        Every band of every channel.
    links
        (3, size) int32: each place's parent (0: none), first child (0: none), and band.
    table
        (bands, 10) int32: kind, level, channel; steps along the high-pass direction and across it, to the
        same place in the two sibling bands, and between rows of children (below the approximation: between
        the three bands); the plane below which the band's magnitudes are 0; the distance between channels.
    segments
        (bands, 2) int32: regions from coarse to fine.
    roots
        int32: coefficients without a parent, coarse to fine.
    flags
        (size,) uint8: `PADDING` where there is no coefficient.
    """

    bands: tuple[Band, ...]
    links: NDArray[np.int32]
    table: NDArray[np.int32]
    segments: NDArray[np.int32]
    roots: NDArray[np.int32]
    flags: NDArray[np.uint8]

    @property
    def size(self) -> int:
        """Length of the flat arrays."""
        return len(self.flags)

    def places(self, band: Band) -> NDArray[np.int32]:
        """Return the indices of a band's coefficients, (rows, columns)."""
        return _places(band)


def _places(band: Band) -> NDArray[np.int32]:
    rows = np.arange(band.rows, dtype=np.int32)[:, None] * band.stride
    return (band.start + rows + np.arange(band.columns)).astype(np.int32)


def _bands(height: int, width: int, channels: int, levels: int) -> tuple[list[Band], int]:
    bands, place = [], 2
    for channel in range(channels):
        for level in range(levels, -1 if levels == 0 else 0, -1):
            rows, columns = level_shape((height, width), level)
            outer_rows, outer_columns = level_shape((height, width), max(level - 1, 0))
            stride = columns + 2
            kinds = [(LL, rows, columns)] if level == levels else []
            if level > 0:
                kinds += [
                    (HL, rows, outer_columns - columns),
                    (LH, outer_rows - rows, columns),
                    (HH, outer_rows - rows, outer_columns - columns),
                ]
            for kind, high, wide in kinds:
                end = place + stride * (rows + 4)
                bands.append(Band(channel, level, kind, high, wide, place + 2 * stride, stride, place, end))
                place = end
    return bands, place + 2


def tree_size(height: int, width: int, channels: int, levels: int) -> int:
    """Return the number of places of a tree, padding included: thin images of many channels take many."""
    return _bands(height, width, channels, levels)[1]


_KEPT_PLACES = 2**20
"""Larger trees are not cached: eight of the largest would take 340 MB."""


def build_tree(
    height: int, width: int, channels: int, levels: int, lowest: tuple[tuple[int, ...], ...] | None = None
) -> Tree:
    """Lay out the coefficients of an image of `levels` levels.

    Parameters
    ----------
    height, width, channels
        The image's shape.
    levels
        0 or more.
    lowest
        Per level, 0 first, the lowest plane of LL, HL, LH and HH; None: all 0.
    """
    large = tree_size(height, width, channels, levels) > _KEPT_PLACES
    return (_build if large else _built)(height, width, channels, levels, lowest)


def _build(
    height: int, width: int, channels: int, levels: int, lowest: tuple[tuple[int, ...], ...] | None
) -> Tree:
    bands, size = _bands(height, width, channels, levels)
    flags = np.full(size, PADDING, np.uint8)
    links = np.zeros((3, size), np.int32)
    parent, child, band_of = links
    count = len(bands)
    per_channel = bands[count // channels].begin - bands[0].begin if channels > 1 else size
    table = np.zeros((count, 10), np.int32)
    index = {(band.channel, band.level, band.kind): n for n, band in enumerate(bands)}
    roots: list[tuple[int, int, NDArray[np.int32]]] = []
    for n, band in enumerate(bands):
        here = _places(band)
        flags[here], band_of[here] = 0, n
        area = band.end - band.begin
        cousins = {LL: (0, 0), HL: (area, 2 * area), LH: (-area, area), HH: (-2 * area, -area)}[band.kind]
        along = (band.stride, 1) if band.kind == LH else (1, band.stride)
        least = 0 if lowest is None else lowest[band.level][band.kind]
        table[n] = (band.kind, band.level, band.channel, *along, *cousins, 0, least, per_channel)
        if band.kind == LL:
            roots.append((-band.level, n, here.reshape(-1)))
            if band.level > 0:
                child[here], table[n, CHILD_STEP] = here + area, area
            continue
        above = index.get((band.channel, band.level + 1, band.kind))
        if above is None:
            parent[here] = here - area * band.kind
            continue
        there = _places(bands[above])
        rows, columns = np.arange(band.rows) // 2, np.arange(band.columns) // 2
        known = (rows[:, None] < there.shape[0]) & (columns < there.shape[1])
        parent[here[known]] = there[np.nonzero(known)[0] // 2, np.nonzero(known)[1] // 2]
        if known.any():
            child[there] = band.start + 2 * (
                np.arange(there.shape[0], dtype=np.int32)[:, None] * band.stride
                + np.arange(there.shape[1], dtype=np.int32)
            )
        table[above, CHILD_STEP] = band.stride
        if not known.all():
            roots.append((-band.level, n, here[~known]))
    order = sorted(range(count), key=lambda n: (-bands[n].level, bands[n].kind, bands[n].channel))
    return Tree(
        tuple(bands),
        frozen_array(links),
        frozen_array(table),
        frozen_array(np.array([(bands[n].begin, bands[n].end) for n in order], np.int32)),
        frozen_array(np.concatenate([places for _, _, places in sorted(roots, key=lambda root: root[:2])])),
        frozen_array(flags),
    )


_built = lru_cache(maxsize=8)(_build)
