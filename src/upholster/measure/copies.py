"""Which texels continue one another verbatim: how much of the exemplar is repeated unbroken."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.measure._kernels import largest_square
from upholster.measure.samples import Window, chosen_windows
from upholster.synthesis import Quilt
from upholster.synthesis._paint_kernels import TURNS, trace_owners
from upholster.types import IntArray

__all__ = ["Copies", "copies", "copy_labels", "quilt_windows"]

MOST_TEXELS = 2**23
SIDE = 2048


@dataclass(frozen=True, slots=True)
class Copies:
    """How much of a quilt is verbatim continuation.

    Attributes
    ----------
    ratio
        Share of the pairs of neighbouring texels (right and lower) that are neighbours in the exemplar too,
        0 to 1. A quilt of whole b×b blocks has at least 1 − 1/b.
    longest
        Largest side, in texels, of a square that is copied unbroken.
    """

    ratio: float
    longest: int


def copies(quilt: Quilt) -> Copies:
    """Measure how much of a quilt is verbatim continuation of the exemplar.

    A texel belongs to the placement that gives it most of its colour. Two neighbouring texels are a verbatim
    continuation if their placements map texels to the exemplar alike, whether or not they are the same one.
    Measured on at most 8 Mtexels, in windows of at most 2048²: no longer repeat is found.

    Parameters
    ----------
    quilt
        The result of a synthesis.

    Returns
    -------
    Copies
        Ratio and longest repeat.

    Raises
    ------
    InputError
        If the quilt has no texel that has a neighbour.

    References
    ----------
    Ashikhmin: Synthesizing natural textures, I3D 2001, on verbatim copying as what pixel methods tend to.
    """
    pairs, continued, longest = 0, 0, 0
    maps = copy_maps(quilt)
    for window in quilt_windows(quilt):
        labels = copy_labels(quilt, window, maps)
        for one, other in ((labels[:, :-1], labels[:, 1:]), (labels[:-1], labels[1:])):
            pairs += one.size
            continued += int(np.count_nonzero((one == other) & (one >= 0)))
        longest = max(longest, int(largest_square(labels, np.zeros(labels.shape[1], np.int32))))
    if not pairs:
        raise InputError("quilt has no neighbouring texels; allowed: charts of at least 1×2 texels")
    return Copies(continued / pairs, longest)


def quilt_windows(quilt: Quilt) -> list[Window]:
    """Choose the parts of a quilt's charts that are measured (`Window.index` is the chart)."""
    shapes = [(chart.height, chart.width) for chart in quilt.charts]
    return chosen_windows(shapes, side=SIDE, most=MOST_TEXELS)


def copy_maps(quilt: Quilt) -> IntArray:
    """Give each placement a number, equal where their maps from texels to the exemplar are.

    Placements of one chart with equal numbers paint each texel with the same pixel.
    """
    placed = quilt.placements
    if not len(placed):
        return np.zeros(0, np.int32)
    turn = TURNS[placed["turn"]]
    row, column = placed["row"].astype(np.int64), placed["column"].astype(np.int64)
    origin_row = placed["source_row"] - 16 * (turn[:, 0] * row + turn[:, 1] * column)
    origin_column = placed["source_column"] - 16 * (turn[:, 2] * row + turn[:, 3] * column)
    keys = np.stack([placed["turn"].astype(np.int64), origin_row, origin_column])
    return np.unique(keys, axis=1, return_inverse=True)[1].reshape(-1).astype(np.int32)


def copy_labels(quilt: Quilt, window: Window, maps: IntArray) -> IntArray:
    """Return which map each texel of a window comes through, `maps` being those of `copy_maps`.

    Returns
    -------
    ndarray
        (height, width) int32; −1 where no placement gives at least half of the colour.
    """
    first = int(np.searchsorted(quilt.placements["chart"], window.index))
    placements = quilt.on_chart(window.index)
    top = placements["row"] - placements["height"] // 2 - window.row
    left = placements["column"] - placements["width"] // 2 - window.column
    touching = (top < window.height) & (top + placements["height"] > 0)
    touching &= (left < window.width) & (left + placements["width"] > 0)
    local: NDArray[np.void] = placements[touching]
    local["row"] -= window.row
    local["column"] -= window.column
    owners = np.empty((window.height, window.width), np.int32)
    scratch = np.empty((2, *quilt.largest_block), np.int32)
    # Read-only, as in `Quilt.sources`: one compiled version of the kernel serves both.
    local.setflags(write=False)
    trace_owners(local, quilt.cells, scratch, owners)
    labels = np.append(maps[first : first + len(placements)][touching], np.int32(-1))
    return labels[owners]  # owner −1 is the last
