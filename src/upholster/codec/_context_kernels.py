"""The inputs of the prediction of a coefficient's bits: scores of its neighbourhood, and contexts.

All data that kernels share is in three arrays, because every further one costs time at each call. `m` (9, n)
has the known data of each place (rows `PARENT` … `WAITING`, see `upholster.codec.tree`), `bands` (bands, 10)
describes the bands, and `a` is the adaptive model with its tables (see `upholster.codec._model_kernels`).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.codec._model_kernels import CONTEXTS, COUNTERS, QUANTA_AT, THRESHOLDS_AT
from upholster.codec.tree import (
    ACROSS,
    ALONG,
    BAND,
    BELOW,
    CHANNEL,
    CHANNEL_STEP,
    COUSIN_A,
    COUSIN_B,
    FLAGS,
    KIND,
    KNOWN,
    LEVEL,
    PARENT,
)
from upholster.runtime.jit import inline, spliced

__all__ = [
    "LEVELS",
    "MODEL_SIZE",
    "QUEUES",
    "REFINED",
    "queue_for",
    "refinement_contexts",
    "sign_contexts",
    "significance_contexts",
    "tree_contexts",
]

Ints = NDArray[np.int32]

QUEUES = 6
"""Queues of the likely pass."""

# Where the counters of each kind of context start.
LEVELS = 12
_BY_SCORE = COUNTERS
_BY_MAP = _BY_SCORE + 16 * LEVELS * 4 * 2
_BY_PARTS = _BY_MAP + 256 * 2 * 4 * 2
_TREE_SCORE = _BY_PARTS + 16 * 16 * 16 * 4
_TREE_NEAR = _TREE_SCORE + 16 * 4 * LEVELS
_TREE_BOTH = _TREE_NEAR + 8 * 4 * 4
_SIGN_PAIRS = _TREE_BOTH + 8 * 8 * 4 * 4
_SIGN_DIAGONALS = _SIGN_PAIRS + 81 * 3
_SIGN_FAR = _SIGN_DIAGONALS + 81 * 3
_SIGN_TREE = _SIGN_FAR + 81 * 3
_SIGN_CHANNELS = _SIGN_TREE + 27 * 3
_REFINE_SCORE = _SIGN_CHANNELS + 27 * 3
_REFINE_VALUE = _REFINE_SCORE + 16 * 3 * 4
# Refinement bits counted by kind of band, level, first or later bit, and value.
REFINED = _REFINE_VALUE + 32 * 16
MODEL_SIZE = REFINED + 4 * LEVELS * 2 * 2


@inline
def _quantum(score: int, plane: int, a: Ints) -> int:
    return a[QUANTA_AT + min(255, score >> plane)]


@inline
def _scores(i: int, m: Ints, bands: Ints) -> tuple[int, int, int, int]:
    # From the magnitudes known so far: the neighbours' score, the whole score, the parent's and the cousins'
    # parts.
    band = m[BAND, i]
    kind = bands[band, KIND]
    p, q = bands[band, ALONG], bands[band, ACROSS]
    along, across = m[KNOWN, i - p] + m[KNOWN, i + p], m[KNOWN, i - q] + m[KNOWN, i + q]
    corners = m[KNOWN, i - p - q] + m[KNOWN, i - p + q] + m[KNOWN, i + p - q] + m[KNOWN, i + p + q]
    if kind == 1 or kind == 2:
        near = 3 * along + 7 * across + 2 * corners
    else:
        near = 4 * along + 4 * across + 3 * corners
    far = m[KNOWN, i - 2 * p] + m[KNOWN, i + 2 * p] + m[KNOWN, i - 2 * q] + m[KNOWN, i + 2 * q]
    cousins = 0
    if kind > 0:
        cousins = m[KNOWN, i + bands[band, COUSIN_A]] + m[KNOWN, i + bands[band, COUSIN_B]]
    channels = 0
    for k in range(1, min(bands[band, CHANNEL], 3) + 1):
        channels += m[KNOWN, i - k * bands[band, CHANNEL_STEP]]
    parent = m[KNOWN, m[PARENT, i]]
    return near, near + 3 * parent + 2 * far + 2 * cousins + 4 * channels, parent, cousins


@inline
def _score_context(i: int, score: int, plane: int, m: Ints, bands: Ints, a: Ints) -> int:
    band = m[BAND, i]
    quantum = _quantum(score, plane, a)
    place = (quantum * LEVELS + bands[band, LEVEL]) * 4 + bands[band, KIND]
    return _BY_SCORE + place * 2 + (1 if bands[band, CHANNEL] > 0 else 0)


@spliced
def significance_contexts(i: int, plane: int, m: Ints, bands: Ints, a: Ints) -> None:
    """Write the three contexts of a significance bit."""
    band = m[BAND, i]
    kind = bands[band, KIND]
    p, q = bands[band, ALONG], bands[band, ACROSS]
    near, score, parent, cousins = _scores(i, m, bands)
    a[CONTEXTS] = _score_context(i, score, plane, m, bands, a)
    around = (
        (m[FLAGS, i - p] & 1)
        | (m[FLAGS, i + p] & 1) << 1
        | (m[FLAGS, i - q] & 1) << 2
        | (m[FLAGS, i + q] & 1) << 3
    )
    around |= (m[FLAGS, i - p - q] & 1) << 4 | (m[FLAGS, i - p + q] & 1) << 5
    around |= (m[FLAGS, i + p - q] & 1) << 6 | (m[FLAGS, i + p + q] & 1) << 7
    place = (around * 2 + (1 if parent > 0 else 0)) * 4 + kind
    a[CONTEXTS + 1] = _BY_MAP + place * 2 + (1 if bands[band, CHANNEL] > 0 else 0)
    parts = _quantum(near, plane, a) * 16 + _quantum(16 * parent, plane, a)
    a[CONTEXTS + 2] = _BY_PARTS + (parts * 16 + _quantum(8 * cousins, plane, a)) * 4 + kind


@inline
def _sign(m: Ints, i: int) -> int:
    # 0: not significant, 1: positive, 2: negative.
    return (m[FLAGS, i] & 1) + ((m[FLAGS, i] & 3) == 3)


@spliced
def sign_contexts(i: int, m: Ints, bands: Ints, a: Ints) -> None:
    """Write the five contexts of a sign."""
    band = m[BAND, i]
    kind = max(0, bands[band, KIND] - 1)
    p, q = bands[band, ALONG], bands[band, ACROSS]
    pairs = ((_sign(m, i - p) * 3 + _sign(m, i + p)) * 3 + _sign(m, i - q)) * 3 + _sign(m, i + q)
    corners = (_sign(m, i - p - q) * 3 + _sign(m, i - p + q)) * 9
    corners += _sign(m, i + p - q) * 3 + _sign(m, i + p + q)
    far = (_sign(m, i - 2 * p) * 3 + _sign(m, i + 2 * p)) * 9
    far += _sign(m, i - 2 * q) * 3 + _sign(m, i + 2 * q)
    tree = _sign(m, m[PARENT, i])
    if bands[band, KIND] > 0:
        tree = (tree * 3 + _sign(m, i + bands[band, COUSIN_A])) * 3
        tree += _sign(m, i + bands[band, COUSIN_B])
    channels = 0
    for k in range(1, min(bands[band, CHANNEL], 3) + 1):
        channels = channels * 3 + _sign(m, i - k * bands[band, CHANNEL_STEP])
    a[CONTEXTS] = _SIGN_PAIRS + pairs * 3 + kind
    a[CONTEXTS + 1] = _SIGN_DIAGONALS + corners * 3 + kind
    a[CONTEXTS + 2] = _SIGN_FAR + far * 3 + kind
    a[CONTEXTS + 3] = _SIGN_TREE + tree * 3 + kind
    a[CONTEXTS + 4] = _SIGN_CHANNELS + channels * 3 + kind


@spliced
def tree_contexts(i: int, plane: int, m: Ints, bands: Ints, a: Ints) -> None:
    """Write the three contexts of a zerotree flag."""
    band = m[BAND, i]
    kind = bands[band, KIND]
    p, q = bands[band, ALONG], bands[band, ACROSS]
    _, score, _, _ = _scores(i, m, bands)
    most: Any = max(max(m[BELOW, i - p], m[BELOW, i + p]), max(m[BELOW, i - q], m[BELOW, i + q]))
    most = max(most, max(m[BELOW, i + bands[band, COUSIN_A]], m[BELOW, i + bands[band, COUSIN_B]]))
    most = min(7, max(0, np.int64(most) - plane))
    before = ((m[FLAGS, i - p] >> 5) & 1) + ((m[FLAGS, i - q] >> 5) & 1) * 2
    quantum = _quantum(score, plane, a)
    a[CONTEXTS] = _TREE_SCORE + (quantum * 4 + kind) * LEVELS + bands[band, LEVEL]
    a[CONTEXTS + 1] = _TREE_NEAR + (most * 4 + before) * 4 + kind
    a[CONTEXTS + 2] = _TREE_BOTH + ((min(quantum, 7) * 8 + most) * 4 + before) * 4 + kind


@spliced
def queue_for(i: int, first: int, plane: int, m: Ints, bands: Ints, a: Ints) -> int:
    """Return the first queue from `first` on whose threshold the probability reaches, or `QUEUES`."""
    _, score, _, _ = _scores(i, m, bands)
    chance = a[_score_context(i, score, plane, m, bands, a)] >> 14
    queue = first
    while queue < QUEUES and chance < a[THRESHOLDS_AT + queue]:
        queue += 1
    return queue


@spliced
def refinement_contexts(i: int, age: int, plane: int, m: Ints, bands: Ints, a: Ints) -> None:
    """Write the two contexts of a refinement bit: `age` 0 is the first, 1 the second, 2 a later one."""
    near, score, _, _ = _scores(i, m, bands)
    kind = bands[m[BAND, i], KIND]
    a[CONTEXTS] = _REFINE_SCORE + (_quantum(score, plane, a) * 3 + age) * 4 + kind
    a[CONTEXTS + 1] = _REFINE_VALUE + min(m[KNOWN, i] >> (plane + 1), 31) * 16 + _quantum(near, plane, a)
