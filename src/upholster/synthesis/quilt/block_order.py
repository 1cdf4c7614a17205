"""The order in which blocks are laid: it grows over the surface from one end, or from what is laid already.

A block then meets laid blocks on one side, and fronts meet only where the surface closes. A block waits for
the earlier blocks near it and for nothing else, so blocks of one *rank* can be laid in parallel.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.synthesis.quilt.kernels._block_order_kernels import rank_in_order

__all__ = ["Lists", "Near", "distances_from", "near_blocks", "ranks_of"]

Lists = tuple[NDArray[np.int64], NDArray[np.int64]]
"""A list of blocks for each of n blocks: where each begins, (n + 1,), and all of them one after another."""

_SAME_SIDE = -0.3
"""Minimum cosine of the normals at neighbouring blocks: the back of a thin board is not near its front."""


@dataclass(frozen=True, eq=False, slots=True)
class Near:
    """For each of n blocks, the blocks near it.

    Attributes
    ----------
    firsts
        (n + 1,) int64: where the list of each block begins.
    others
        (m,) int64: the blocks in these lists, ascending in each.
    lengths
        (m,) float64: the distances to them.
    """

    firsts: NDArray[np.int64]
    others: NDArray[np.int64]
    lengths: FloatArray

    @property
    def owners(self) -> NDArray[np.int64]:
        """The block to which each entry of `others` belongs, (m,)."""
        return np.repeat(np.arange(len(self.firsts) - 1), np.diff(self.firsts))

    def chosen(self, which: NDArray[np.bool_]) -> "Near":
        """Return the lists with only those entries that the mask `which` (m,) selects."""
        counts = np.bincount(self.owners[which], minlength=len(self.firsts) - 1)
        return Near(np.append(0, np.cumsum(counts)), self.others[which], self.lengths[which])

    def earlier(self, names: NDArray[np.int64], first: int) -> Lists:
        """Return for each block from `first` on the earlier ones near it, once all have new `names` (n,)."""
        one, other = names[self.owners], names[self.others]
        kept = (other < one) & (one >= first)
        counts = np.bincount(one[kept], minlength=len(names))
        pairs = np.sort(one[kept] * len(names) + other[kept])
        return np.append(0, np.cumsum(counts)), pairs % max(1, len(names))


def near_blocks(spots: FloatArray, reach: float, tile: FloatArray | None = None, *, first: int = 0) -> Near:
    """Return for each of some points (n, 3) the others that are less than `reach` away.

    `tile` (2, 3) is the box of a tile, from, to: its opposite sides meet. The lists of points before `first`
    are empty.
    """
    points, names = spots, np.arange(len(spots))
    if tile is not None:
        points, names = _with_copies(spots, reach, tile)
    cells = np.floor((points - points.min(axis=0, initial=0.0)) / reach).astype(np.int64) + 1
    shape = cells.max(axis=0, initial=0) + 2
    keys = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    order = np.argsort(keys, kind="stable")
    ordered, own, found = keys[order], np.arange(first, len(spots)), []
    x, y, z = np.ascontiguousarray(points[order].T)
    for a, b in product((-1, 0, 1), repeat=2):
        # Three cells that follow each other along z have keys that follow each other.
        wanted = keys[own] + (a * shape[1] + b) * shape[2]
        start, stop = np.searchsorted(ordered, wanted - 1), np.searchsorted(ordered, wanted + 1, "right")
        count = stop - start
        one = np.repeat(own, count)
        at = np.arange(len(one)) - np.repeat(np.cumsum(count) - count - start, count)
        away = sum((np.repeat(points[own, n], count) - ways[at]) ** 2 for n, ways in enumerate((x, y, z)))
        other = names[order[at]]
        kept = np.flatnonzero((away < reach * reach) & (other != one))
        found.append((one[kept], other[kept], np.sqrt(away[kept])))
    one, other, lengths = (np.concatenate(each) for each in zip(*found, strict=True))
    pairs = one * len(spots) + other
    by = np.lexsort((lengths, pairs)) if tile is not None else np.argsort(pairs)
    # Two copies of a block may be near one of a small tile: the nearer counts.
    by = by[np.diff(pairs[by], prepend=-1) != 0]
    firsts = np.append(0, np.cumsum(np.bincount(one[by], minlength=len(spots))))
    return Near(firsts, other[by], lengths[by])


def _with_copies(spots: FloatArray, reach: float, tile: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    # Points and their copies beyond the sides of a tile, with the number of the point of each.
    extent, parts, names = tile[1] - tile[0], [spots], [np.arange(len(spots))]
    for way in product((-1, 0, 1), repeat=3):
        shift = np.array(way) * extent
        if any(way) and shift.any() and not any(w and not e for w, e in zip(way, extent, strict=True)):
            copies = spots + shift
            close = ((copies > tile[0] - reach) & (copies < tile[1] + reach)).all(axis=1)
            parts.append(copies[close])
            names.append(np.flatnonzero(close))
    return np.concatenate(parts), np.concatenate(names)


def distances_from(near: Near, normals: FloatArray, known: FloatArray) -> FloatArray:
    """Return the distance of each block along the surface: from those that are laid, or from one end.

    Parameters
    ----------
    near
        The blocks near each, close enough that neighbours are among them.
    normals
        (n, 3) unit normals at the blocks.
    known
        (n,) the distances of blocks from what is laid already; infinite where they are not known.

    Returns
    -------
    ndarray
        (n,). Each connected part of the surface on which nothing is laid has its own end: the block that is
        farthest from its first one.
    """
    owners = near.owners
    near = near.chosen((normals[owners] * normals[near.others]).sum(axis=1) > _SAME_SIDE)
    away = _relaxed(near, known)
    rest = ~np.isfinite(away)
    if rest.any():
        part = _relaxed(near, np.arange(len(known), dtype=np.float64), least=True).astype(np.int64)
        firsts = np.unique(part[rest])
        start = np.full(len(known), np.inf)
        start[firsts] = 0.0
        first_away = _relaxed(near, start)
        by = np.lexsort((np.arange(len(known)), -first_away, part))
        by = by[rest[by]]
        ends = by[np.diff(part[by], prepend=-1) != 0]
        start[:] = np.inf
        start[ends] = 0.0
        away = np.where(rest, _relaxed(near, start), away)
    return away


def _relaxed(near: Near, values: FloatArray, *, least: bool = False) -> FloatArray:
    # The shortest distances that follow from some known ones (Bellman, Ford); or each part's least value.
    lengths = np.zeros(len(near.others)) if least else near.lengths
    rows = np.flatnonzero(np.diff(near.firsts))
    found = values.copy()
    while len(rows):
        through = np.minimum.reduceat(found[near.others] + lengths, near.firsts[rows])
        if (through >= found[rows]).all():
            break
        found[rows] = np.minimum(found[rows], through)
    return found


def ranks_of(near: Near, first: int, order: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the rank of each block from `first` on: one more than the highest of the earlier ones near it.

    `order` (m,) lists these blocks in their order, counted from `first`. Blocks of one rank are not near each
    other.
    """
    ranks = np.full(len(near.firsts) - 1, -1, np.int64)
    rank_in_order(near.firsts, near.others, first + order.astype(np.int64), ranks)
    return ranks[first:]
