"""Shapiro's embedded zerotree coder, one plane after another: encoder and decoder are the same loop.

A plane has three passes. The *likely* pass visits insignificant coefficients whose neighbourhood makes
significance likely, most probable first, in six queues. The *subordinate* pass refines coefficients that were
significant before. The *dominant* pass visits the rest from the roots down; after a zero it codes whether the
coefficient is a zerotree root (ZTR: no descendant becomes significant in this plane) or an isolated zero
(IZ). If the available bytes do not determine the next bit, the loop returns, and can continue when there are
more.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.codec._context_kernels import (
    LEVELS,
    QUEUES,
    REFINED,
    queue_for,
    refinement_contexts,
    sign_contexts,
    significance_contexts,
    tree_contexts,
)
from upholster.codec._model_kernels import BYTES_DONE, code_bit
from upholster.codec.tree import (
    ACROSS,
    ALONG,
    BAND,
    BELOW,
    CHANNEL_STEP,
    CHILD,
    CHILD_STEP,
    COUSIN_A,
    COUSIN_B,
    FLAGS,
    FOLLOWING,
    KIND,
    KNOWN,
    LEVEL,
    LINE,
    LOWEST,
    PADDING,
    PARENT,
    PRECEDING,
    WAITING,
)
from upholster.runtime.jit import inline, kernel, spliced

__all__ = [
    "DOMINANT",
    "LIKELY",
    "NEGATIVE",
    "NEWLY",
    "PHASE",
    "PLACE",
    "PLANE",
    "SEGMENT",
    "SIGNIFICANT",
    "SIGNIFICANT_COUNT",
    "STARTED",
    "SUBORDINATE",
    "Coder",
    "code_planes",
]

Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Bytes = NDArray[np.uint8]


class Coder(NamedTuple):
    """The coder's state, the bytes, and the adaptive model (see `upholster.codec._model_kernels`)."""

    state: Longs
    data: Bytes
    a: Ints


# Positions in the state, after those of the arithmetic coder.
PLANE, PHASE, QUEUE, PLACE, STEP, SEGMENT, HEAD, TAIL, CURRENT, SIGNIFICANT_COUNT = range(6, 16)
# Heads and tails of the queues.
ENDS = 16
# Number of bits coded, and the number at which a decoder waits for more bytes (SPEC.md, section 9).
SYMBOLS, MOST_SYMBOLS = 28, 29
# Phases of a plane, steps of a coefficient.
STARTED, LIKELY, SUBORDINATE, DOMINANT = 0, 1, 2, 3
_NEXT, _SIGNIFICANCE, _SIGN, _TREE = 0, 1, 2, 3
# Flags.
SIGNIFICANT, NEGATIVE, NEWLY, AWAKE, VISITED, ROOT = 1, 2, 4, 8, 16, 32
# Queue entries for a coefficient that is in no queue: nowhere, or done in this plane.
_NOWHERE, _DONE = 9, 8

# Mixers: by queue and kind, by kind, by kind, by age.
_MIX_SIGNIFICANCE, _MIX_SIGN, _MIX_TREE, _MIX_REFINE = 0, 28, 32, 36


@spliced
def _append(i: int, queue: int, state: Longs, m: Ints) -> None:
    last = state[ENDS + 2 * queue + 1]
    m[WAITING, i] = queue
    m[FOLLOWING, i], m[PRECEDING, i] = -1, last
    if last >= 0:
        m[FOLLOWING, last] = i
    else:
        state[ENDS + 2 * queue] = i
    state[ENDS + 2 * queue + 1] = i


@spliced
def _remove(i: int, state: Longs, m: Ints) -> None:
    queue, before, after = m[WAITING, i], m[PRECEDING, i], m[FOLLOWING, i]
    if before >= 0:
        m[FOLLOWING, before] = after
    else:
        state[ENDS + 2 * queue] = after
    if after >= 0:
        m[PRECEDING, after] = before
    else:
        state[ENDS + 2 * queue + 1] = before


@spliced
def _start_plane(state: Longs, segments: Ints, m: Ints, bands: Ints, a: Ints) -> None:
    plane = state[PLANE]
    for n in range(ENDS, ENDS + 2 * QUEUES):
        state[n] = -1
    for s in range(segments.shape[0]):
        for i in range(segments[s, 0], segments[s, 1]):
            flag = m[FLAGS, i]
            if flag & PADDING:
                continue
            m[FLAGS, i] = flag & (SIGNIFICANT | NEGATIVE | AWAKE)
            m[WAITING, i] = _NOWHERE
            if flag & (AWAKE | SIGNIFICANT) == AWAKE and plane >= bands[m[BAND, i], LOWEST]:
                queue = queue_for(i, 0, plane, m, bands, a)
                if queue < QUEUES:
                    _append(i, queue, state, m)


@inline
def _child(i: int, n: int, m: Ints, bands: Ints) -> int:
    # The n-th child of a coefficient that has children: 0 to 3, or 0 to 2 below the approximation; 0: there
    # is none.
    band = m[BAND, i]
    if bands[band, KIND] == 0:
        return m[CHILD, i] + n * bands[band, CHILD_STEP] if n < 3 else 0
    return m[CHILD, i] + (n & 1) + (n >> 1) * bands[band, CHILD_STEP]


@spliced
def _wake(i: int, state: Longs, m: Ints, bands: Ints, a: Ints) -> None:
    # A neighbour of a newly significant coefficient may move to a better queue.
    flag = m[FLAGS, i]
    if flag & PADDING:
        return
    m[FLAGS, i] = flag | AWAKE
    plane = state[PLANE]
    if flag & (SIGNIFICANT | VISITED) or state[PHASE] != LIKELY or plane < bands[m[BAND, i], LOWEST]:
        return
    queue = queue_for(i, state[QUEUE], plane, m, bands, a)
    if queue < QUEUES and queue < m[WAITING, i]:
        if m[WAITING, i] < QUEUES:
            _remove(i, state, m)
        _append(i, queue, state, m)


@inline
def _neighbour(i: int, n: int, along: int, across: int, m: Ints, bands: Ints) -> int:
    band = m[BAND, i]
    # The coefficients affected by a new significance: 8 neighbours, 4 children, 2 cousins, the next channel;
    # 0: there is none.
    if n < 8:
        row, column = (0, 0, -1, 1, -1, -1, 1, 1)[n], (-1, 1, 0, 0, -1, 1, -1, 1)[n]
        return i + row * across + column * along
    if n < 12:
        return _child(i, n - 8, m, bands) if m[CHILD, i] > 0 else 0
    if n == 14:
        return i + bands[band, CHANNEL_STEP]
    return i + bands[band, COUSIN_A if n == 12 else COUSIN_B] if bands[band, KIND] > 0 else 0


@spliced
def _become_significant(i: int, negative: int, state: Longs, m: Ints, bands: Ints, a: Ints) -> None:
    plane = state[PLANE]
    m[FLAGS, i] |= SIGNIFICANT | NEWLY | (NEGATIVE if negative else 0)
    m[KNOWN, i] = 1 << plane
    state[SIGNIFICANT_COUNT] += 1
    ancestor = m[PARENT, i]
    while ancestor > 0 and m[BELOW, ancestor] < plane + 1:
        m[BELOW, ancestor] = plane + 1
        ancestor = m[PARENT, ancestor]
    band = m[BAND, i]
    p, q = bands[band, ALONG], bands[band, ACROSS]
    for n in range(15):
        near = _neighbour(i, n, p, q, m, bands)
        if 0 < near < m.shape[1]:
            _wake(near, state, m, bands, a)
    m[FLAGS, i - 2 * p] |= AWAKE
    m[FLAGS, i + 2 * p] |= AWAKE
    m[FLAGS, i - 2 * q] |= AWAKE
    m[FLAGS, i + 2 * q] |= AWAKE


@spliced
def _next_in_queue(state: Longs, m: Ints) -> int:
    while state[QUEUE] < QUEUES and state[ENDS + 2 * state[QUEUE]] < 0:
        state[QUEUE] += 1
    if state[QUEUE] == QUEUES:
        return -1
    i = state[ENDS + 2 * state[QUEUE]]
    _remove(i, state, m)
    m[WAITING, i] = _DONE
    return i


@inline
def _code(coder: Coder, inputs: int, mixer: int, limit: int, encoding: bool, bit: int) -> int:
    # Codes a bit and counts it; -1 if a decoder needs more bytes, even if only its limit of bits requires
    # them.
    state = coder.state
    if state[SYMBOLS] >= state[MOST_SYMBOLS]:
        return -1
    found = code_bit(state, coder.data, coder.a, inputs, mixer, limit, encoding, bit)
    if found >= 0:
        state[SYMBOLS] += 1
    return found


@inline
def _start_refining(state: Longs, segments: Ints) -> None:
    state[PHASE], state[SEGMENT], state[PLACE] = SUBORDINATE, 0, segments[0, 0]


@inline
def _start_trees(state: Longs, m: Ints, roots: Ints) -> None:
    # The line starts with all roots; children join it after those that are not zerotree roots.
    state[PHASE], state[STEP] = DOMINANT, _NEXT
    state[HEAD], state[TAIL] = 0, roots.shape[0]
    for n in range(roots.shape[0]):
        m[LINE, n] = roots[n]


@inline
def _refine(i: int, coder: Coder, values: Ints, m: Ints, bands: Ints, encoding: bool) -> bool:
    # Codes the next bit of a coefficient that was significant before; returns whether that was possible.
    state, a = coder.state, coder.a
    plane, band = state[PLANE], m[BAND, i]
    if m[FLAGS, i] & (SIGNIFICANT | NEWLY | PADDING) != SIGNIFICANT or plane < bands[band, LOWEST]:
        return True
    so_far = m[KNOWN, i] >> (plane + 1)
    age = 0 if so_far == 1 else 1 if so_far < 4 else 2
    refinement_contexts(i, age, plane, m, bands, a)
    bit = (abs(values[i]) >> plane) & 1 if encoding else 0
    bit = _code(coder, 2, _MIX_REFINE + age, 400, encoding, bit)
    if bit < 0:
        return False
    m[KNOWN, i] |= bit << plane
    group = (bands[band, KIND] * LEVELS + bands[band, LEVEL]) * 2 + min(age, 1)
    a[REFINED + 2 * group + bit] += 1
    return True


@inline
def _refine_plane(
    coder: Coder, values: Ints, m: Ints, bands: Ints, segments: Ints, encoding: bool, most_bytes: int
) -> bool:
    # The subordinate pass; returns whether it is done.
    state = coder.state
    while state[SEGMENT] < segments.shape[0]:
        while state[PLACE] < segments[state[SEGMENT], 1]:
            if encoding and state[BYTES_DONE] >= most_bytes:
                return False
            if not _refine(state[PLACE], coder, values, m, bands, encoding):
                return False
            state[PLACE] += 1
        state[SEGMENT] += 1
        if state[SEGMENT] < segments.shape[0]:
            state[PLACE] = segments[state[SEGMENT], 0]
    return True


@inline
def _next_coefficient(state: Longs, m: Ints, bands: Ints) -> bool:
    # Selects the next coefficient of the likely or the dominant pass; returns whether there is one.
    if state[PHASE] == LIKELY:
        i = int64(_next_in_queue(state, m))
        state[STEP] = _SIGNIFICANCE
    else:
        i = int64(-1)
        if state[HEAD] < state[TAIL]:
            i = int64(m[LINE, state[HEAD]])
            state[HEAD] += 1
            coded = m[FLAGS, i] & (SIGNIFICANT | VISITED) or state[PLANE] < bands[m[BAND, i], LOWEST]
            state[STEP] = _TREE if coded else _SIGNIFICANCE
    state[CURRENT] = i
    if i < 0:
        state[STEP] = _NEXT
    return i >= 0


@inline
def _code_significance(coder: Coder, values: Ints, m: Ints, bands: Ints, encoding: bool) -> bool:
    # Whether the current coefficient becomes significant in this plane.
    state, a = coder.state, coder.a
    i, plane = state[CURRENT], state[PLANE]
    significance_contexts(i, plane, m, bands, a)
    queue = state[QUEUE] if state[PHASE] == LIKELY else QUEUES
    bit = (abs(values[i]) >> plane) & 1 if encoding else 0
    mixer = _MIX_SIGNIFICANCE + queue * 4 + bands[m[BAND, i], KIND]
    bit = _code(coder, 3, mixer, 255, encoding, bit)
    if bit < 0:
        return False
    m[FLAGS, i] |= VISITED
    state[STEP] = _SIGN if bit else _TREE
    return True


@inline
def _code_sign(coder: Coder, values: Ints, m: Ints, bands: Ints, encoding: bool) -> bool:
    state, a = coder.state, coder.a
    i = state[CURRENT]
    sign_contexts(i, m, bands, a)
    bit = 1 if encoding and values[i] < 0 else 0
    mixer = _MIX_SIGN + bands[m[BAND, i], KIND]
    bit = _code(coder, 5, mixer, 400, encoding, bit)
    if bit < 0:
        return False
    _become_significant(i, bit, state, m, bands, a)
    state[STEP] = _TREE
    return True


@inline
def _code_tree(coder: Coder, deepest: Ints, m: Ints, bands: Ints, encoding: bool) -> bool:
    # Whether the current coefficient is a zerotree root; if not, its children join the line.
    state, a = coder.state, coder.a
    i, plane = state[CURRENT], state[PLANE]
    bit = int64(0)
    if m[FLAGS, i] & SIGNIFICANT == 0 and m[BELOW, i] == 0:
        tree_contexts(i, plane, m, bands, a)
        bit = int64(1 if encoding and deepest[i] >> plane == 0 else 0)
        mixer = _MIX_TREE + bands[m[BAND, i], KIND]
        bit = _code(coder, 3, mixer, 255, encoding, bit)
        if bit < 0:
            return False
    if bit:
        m[FLAGS, i] |= ROOT
        return True
    for n in range(4):
        child = _child(i, n, m, bands)
        if child > 0 and m[FLAGS, child] & PADDING == 0:
            m[LINE, state[TAIL]] = child
            state[TAIL] += 1
    return True


@kernel
def code_planes(
    coder: Coder,
    values: Ints,
    deepest: Ints,
    m: Ints,
    bands: Ints,
    segments: Ints,
    roots: Ints,
    encoding: bool,
    most_bytes: int,
    most_significant: int,
) -> bool:
    """Code plane after plane, from the current state; return whether all planes are done.

    When encoding, `values` are the coefficients and `deepest` the largest magnitude among each one's
    descendants; it stops after `most_bytes` bytes, or when `most_significant` coefficients are significant.
    """
    state = coder.state
    while state[PLANE] >= 0:
        if state[PHASE] == STARTED:
            _start_plane(state, segments, m, bands, coder.a)
            state[PHASE], state[QUEUE], state[STEP] = LIKELY, 0, _NEXT
        if state[PHASE] == SUBORDINATE:
            if not _refine_plane(coder, values, m, bands, segments, encoding, most_bytes):
                return False
            _start_trees(state, m, roots)
        while state[STEP] != _NEXT or _next_coefficient(state, m, bands):
            full = state[BYTES_DONE] >= most_bytes or state[SIGNIFICANT_COUNT] >= most_significant
            if encoding and full:
                return False
            if state[STEP] == _SIGNIFICANCE and not _code_significance(coder, values, m, bands, encoding):
                return False
            if state[STEP] == _SIGN and not _code_sign(coder, values, m, bands, encoding):
                return False
            trees = state[PHASE] == DOMINANT and m[CHILD, state[CURRENT]] > 0
            if trees and not _code_tree(coder, deepest, m, bands, encoding):
                return False
            state[STEP] = _NEXT
        if state[PHASE] == LIKELY:
            _start_refining(state, segments)
        else:
            state[PHASE] = STARTED
            state[PLANE] -= 1
    return True
