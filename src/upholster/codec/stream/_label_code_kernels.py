"""Coding label maps: encoder and decoder are the same loops (SPEC.md, section 5.2)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.codec.stream._bit_kernels import MISSING, BitCoder, begin, code_counted, undo
from upholster.runtime.jit import allocating_kernel, inline

__all__ = ["LABEL_COUNTERS", "NamedPlacements", "code_labels"]

_CONTEXTS, _PLAIN_BITS = 256, 20
_NONE, _PLAIN = 6, 7
"""Places after the six candidates of a label: that of −1, and that of plain bits."""

LABEL_COUNTERS = _CONTEXTS * _PLAIN + _PLAIN_BITS


class NamedPlacements(NamedTuple):
    """The allowed labels of a map: the layer, its first placement, and the number of its placements."""

    layer: int
    first: int
    total: int


@inline
def _at(labels: NDArray[np.int32], i: int, j: int) -> int:
    # A label that is known; −2 outside the map.
    if i < 0 or j < 0 or j >= labels.shape[1]:
        return -2
    return int(labels[i, j])


class _Guesses(NamedTuple):
    """Candidates for a label, by place, and the context of their bits."""

    west: int
    north: int
    nearest: int
    north_east: int
    right: int
    below: int
    context: int


@inline
def _guesses(labels: NDArray[np.int32], nearest: NDArray[np.int32], i: int, j: int) -> _Guesses:
    w, n = _at(labels, i, j - 1), _at(labels, i - 1, j)
    nw, ne = _at(labels, i - 1, j - 1), _at(labels, i - 1, j + 1)
    v = int64(nearest[i, j])
    right = int64(nearest[i, min(j + 2, nearest.shape[1] - 1)])
    below = int64(nearest[min(i + 2, nearest.shape[0] - 1), j])
    context = (w == n) | (w == nw) << 1 | (n == ne) << 2 | (n == nw) << 3
    context |= (v == w) << 4 | (v == n) << 5 | (right == w) << 6 | (below == n) << 7
    return _Guesses(w, n, v, ne, right, below, int64(context))


@inline
def _is(coder: BitCoder, place: int, context: int, encoding: bool, bit: bool) -> int:
    # Whether the label is the candidate of a place.
    return code_counted(coder, _CONTEXTS * place + context, encoding, 1 if bit else 0)


@inline
def _plain_label(coder: BitCoder, named: NamedPlacements, encoding: bool, label: int) -> int:
    bits, found = int64(0), int64(0)
    while (named.total - 1) >> bits:
        bits += 1
    for b in range(bits - 1, -1, -1):
        bit = code_counted(coder, _CONTEXTS * _PLAIN + b, encoding, (label - named.first) >> b & 1)
        if bit < 0:
            return MISSING
        found = 2 * found + bit
    return int(named.first + found)


@inline
def _code_label(
    coder: BitCoder,
    labels: NDArray[np.int32],
    nearest: NDArray[np.int32],
    named: NamedPlacements,
    i: int,
    j: int,
    encoding: bool,
) -> int:
    guesses, label = _guesses(labels, nearest, i, j), int64(labels[i, j])
    if named.layer > 0:
        bit = _is(coder, _NONE, guesses.context, encoding, label < 0)
        if bit != 0:
            return -1 if bit > 0 else MISSING
    candidates = guesses[:_NONE]
    for place in range(_NONE):
        is_skipped = candidates[place] < 0
        for before in range(place):
            is_skipped |= candidates[before] == candidates[place]
        if is_skipped:
            continue
        bit = _is(coder, place, guesses.context, encoding, label == candidates[place])
        if bit != 0:
            return candidates[place] if bit > 0 else MISSING
    return _plain_label(coder, named, encoding, label)


@allocating_kernel
def code_labels(
    coder: BitCoder,
    labels: NDArray[np.int32],
    nearest: NDArray[np.int32],
    named: NamedPlacements,
    start: int,
    stop: int,
    encoding: bool,
) -> int:
    """Code cells [start, stop) of a label map, in raster order.

    Parameters
    ----------
    coder
        The coder of all labels.
    labels, nearest
        (rows, columns): the map, filled in advance by an encoder, and that of the nearest placements.
    named
        The allowed labels.
    start, stop
        The range of cells.
    encoding
        Whether to encode.

    Returns
    -------
    int
        The first cell not coded, or −1 − the first cell whose label is not allowed.
    """
    kept = np.empty_like(coder.state)
    for place in range(start, stop):
        begin(coder, kept)
        i, j = place // labels.shape[1], place % labels.shape[1]
        label = _code_label(coder, labels, nearest, named, i, j, encoding)
        if label == MISSING:
            undo(coder, kept)
            return place
        if label >= named.first + named.total:
            return -1 - place
        labels[i, j] = label
    return stop
