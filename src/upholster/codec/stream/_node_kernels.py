"""Coding the nodes of warp fields, from coarse to fine (SPEC.md, section 5.3)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.codec.stream._bit_kernels import MISSING, NUMBER_COUNTERS, BitCoder, begin, code_number, undo
from upholster.runtime.jit import allocating_kernel, inline, kernel

__all__ = ["COARSEST", "NODE_COUNTERS", "code_nodes", "guess_nodes", "stage_size"]

NODE_COUNTERS = 4 * NUMBER_COUNTERS

COARSEST = 4
"""Stride of the nodes that are coded first; then follow the nodes halfway between, twice."""

_ANGLE = 2
"""Index of a node's number that is an angle."""


@inline
def _wrapped(change: int) -> int:
    # An angle's change, the short way round.
    return ((change + 128) & 255) - 128


@inline
def _every(count: int, first: int, stride: int) -> int:
    # The count of first, first + stride, … below `count`.
    return max(0, (count - first + stride - 1) // stride)


@inline
def _place(rows: int, columns: int, stride: int, number: int) -> tuple[int, int, int]:
    # Row and column of a node of a stage, and along which axis it is guessed.
    if stride == COARSEST:
        across = _every(columns, 0, stride)
        return stride * (number // across), stride * (number % across), 0
    across = _every(columns, 0, 2 * stride)
    between = across * _every(rows, stride, 2 * stride)
    if number < between:
        return stride + 2 * stride * (number // across), 2 * stride * (number % across), 0
    number -= between
    across = _every(columns, stride, 2 * stride)
    return stride * (number // across), stride + 2 * stride * (number % across), 1


@inline
def _between(nodes: NDArray[np.int16], i: int, j: int, axis: int, stride: int, k: int) -> int:
    # The mean of the nodes on both sides; the one before, if there is none after.
    down, right = (stride, 0) if axis == 0 else (0, stride)
    before = int64(nodes[i - down, j - right, k])
    if i + down >= nodes.shape[0] or j + right >= nodes.shape[1]:
        return int(before)
    change = nodes[i + down, j + right, k] - before
    if k == _ANGLE:
        change = _wrapped(change)
    return int(before + ((change + 1) >> 1))


@inline
def _guess(
    nodes: NDArray[np.int16], first: NDArray[np.int16], place: tuple[int, int, int], stride: int, k: int
) -> int:
    i, j, axis = place
    if stride < COARSEST:
        return _between(nodes, i, j, axis, stride, k)
    if j > 0:
        return int(nodes[i, j - stride, k])
    return int(nodes[i - stride, 0, k]) if i > 0 else int(first[k])


def stage_size(rows: int, columns: int, stride: int) -> int:
    """Return the number of a field's nodes in a stage."""
    coarse = -(-rows // stride) * -(-columns // stride)
    if stride == COARSEST:
        return coarse
    return coarse - -(-rows // (2 * stride)) * -(-columns // (2 * stride))


@kernel
def guess_nodes(
    nodes: NDArray[np.int16], first: NDArray[np.int16], stride: int, start: int, stop: int
) -> None:
    """Set the nodes of a stage, from number `start` on, to their predictions."""
    for number in range(start, stop):
        place = _place(nodes.shape[0], nodes.shape[1], stride, number)
        for k in range(4):
            value = _guess(nodes, first, place, stride, k)
            nodes[place[0], place[1], k] = value & 255 if k == _ANGLE else value


@allocating_kernel
def code_nodes(
    coder: BitCoder,
    nodes: NDArray[np.int16],
    first: NDArray[np.int16],
    left: NDArray[np.int64],
    stage: tuple[int, int, int],
    limits: NDArray[np.int64],
    encoding: bool,
) -> Any:
    """Code nodes of one stage of a chart.

    Parameters
    ----------
    coder
        The coder of all nodes.
    nodes
        (rows, columns, 4) of the chart; an encoder fills them in advance.
    first
        (4,) prediction of the chart's first node.
    left
        (4,) residuals of the node coded last.
    stage
        Its stride; the first node to code and the end of them.
    limits
        (4,) largest magnitudes of sizes and shear.
    encoding
        Whether to encode.

    Returns
    -------
    int
        The first node that the received bytes do not determine, or −1 if a node breaks a limit.
    """
    kept = np.empty_like(coder.state)
    rest = np.zeros(4, np.int64)
    stride, start, stop = stage
    for number in range(start, stop):
        place = _place(nodes.shape[0], nodes.shape[1], stride, number)
        begin(coder, kept)
        for k in range(4):
            guess = _guess(nodes, first, place, stride, k)
            change = nodes[place[0], place[1], k] - guess if encoding else int64(0)
            if k == _ANGLE:
                change = _wrapped(change)
            context = 2 * min(3, abs(left[k])) + (1 if k > 0 and rest[k - 1] != 0 else 0)
            rest[k] = code_number(coder, k, context, encoding, change)
            if rest[k] == MISSING:
                undo(coder, kept)
                return number
            value = guess + rest[k]
            if k == _ANGLE:
                value &= 255
            elif abs(value) > limits[k]:
                return -1
            nodes[place[0], place[1], k] = value
        for k in range(4):
            left[k] = rest[k]
    return stop
