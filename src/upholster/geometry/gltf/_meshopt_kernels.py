"""Decoding meshopt's three codecs.

References
----------
Khronos: EXT_meshopt_compression, appendix A: bitstream.
"""

from typing import Any

from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.runtime.jit import inline, kernel

__all__ = ["decode_attributes", "decode_indices", "decode_triangles"]

_MASK = 0xFFFFFFFF


@kernel
def decode_attributes(data: NDArray[Any], stride: int, out: NDArray[Any]) -> bool:
    """Decode mode 0, attributes.

    Parameters
    ----------
    data
        (n,) uint8, compressed.
    stride
        Bytes of an element: 4 to 256.
    out
        (count · stride,) uint8, filled.

    Returns
    -------
    bool
        Whether the data were complete.
    """
    count = len(out) // stride
    end = len(data) - max(32, stride)
    if end < 1:
        return False
    most = min((8192 // stride) & ~15, 256)
    at = 1
    first = 0
    while first < count:
        size = min(most, count - first)
        for byte in range(stride):
            last = out[(first - 1) * stride + byte] if first else data[len(data) - stride + byte]
            at = _decode_bytes(data, at, end, size, int(last), out, first * stride + byte, stride)
            if at < 0:
                return False
        first += size
    return at == end


@inline
def _decode_bytes(
    data: NDArray[Any], at: int, end: int, size: int, last: int, out: NDArray[Any], to: int, stride: int
) -> int:
    """Decode one byte of `size` elements; return the position after the data, -1 if they end early."""
    groups = (size + 15) // 16
    heads = at
    at += (groups + 3) // 4
    if at > end:
        return -1
    for group in range(groups):
        mode = (data[heads + group // 4] >> (2 * (group & 3))) & 3
        bits = 0 if mode == 0 else 1 << mode  # 0, 2, 4 or 8
        more = at + 2 * bits  # position of bytes stored separately
        if more > end:
            return -1
        for k in range(16):
            delta = 0
            if bits == 8:
                delta = int(data[at + k])
            elif bits:
                shift = 8 - bits - (k * bits & 7)
                delta = (int(data[at + k * bits // 8]) >> shift) & ((1 << bits) - 1)
                if delta == (1 << bits) - 1:
                    if more >= end:
                        return -1
                    delta = int(data[more])
                    more += 1
            last = (last + ((delta >> 1) ^ -(delta & 1))) & 255
            if 16 * group + k < size:
                out[to + (16 * group + k) * stride] = last
        at = more
    return at


@kernel
def decode_indices(data: NDArray[Any], out: NDArray[Any]) -> bool:
    """Decode mode 2, indices: from (n,) uint8 to (count,) uint32; return whether the data were complete."""
    at, end = 1, len(data) - 4
    low, high = 0, 0
    for k in range(len(out)):
        value, at = _number(data, at, end)
        if at < 0:
            return False
        delta = (value >> 2) ^ -((value >> 1) & 1)
        if value & 1:
            high = (high + delta) & _MASK
            out[k] = high
        else:
            low = (low + delta) & _MASK
            out[k] = low
    return at == end


@inline
def _number(data: NDArray[Any], at: int, end: int) -> tuple[int, int]:
    """Read a number of 7 bits a byte; return it and the position after it, -1 if the data end early."""
    value = 0
    for k in range(5):
        if at >= end:
            return 0, -1
        byte = int(data[at])
        at += 1
        value |= (byte & 127) << (7 * k)
        if byte < 128:
            return value & _MASK, at
    return 0, -1


@kernel
def decode_triangles(
    data: NDArray[Any], edges: NDArray[int64], vertices: NDArray[int64], out: NDArray[Any]
) -> bool:
    """Decode mode 1, triangles.

    Parameters
    ----------
    data
        (n,) uint8, compressed.
    edges, vertices
        (16, 2) and (16,) zeros, working space: the most recent edges and vertices.
    out
        (count,) uint32, filled; count is a multiple of 3.

    Returns
    -------
    bool
        Whether the data were complete.
    """
    count = len(out) // 3
    end = len(data) - 16
    at = 1 + count
    if at > end:
        return False
    following, last = 0, 0  # the next new vertex, and the last one stored explicitly
    edge, vertex = 0, 0  # positions for the next ones
    for k in range(count):
        code = int(data[1 + k])
        high, low = code >> 4, code & 15
        if high < 15:
            a, b = edges[(edge - 1 - high) & 15, 0], edges[(edge - 1 - high) & 15, 1]
            is_new = True
            if low == 0:
                c = following
                following += 1
            elif low < 13:
                c = vertices[(vertex - 1 - low) & 15]
                is_new = False
            elif low < 15:
                last = (last + (1 if low == 14 else -1)) & _MASK
                c = last
            else:
                c, at = _delta(data, at, end, last)
                last = c
            if is_new:
                vertices[vertex & 15] = c
                vertex += 1
        else:
            table = int(data[end + low]) if low < 14 else 0
            written = low >= 14
            if written:
                if at >= end:
                    return False
                table = int(data[at])
                at += 1
                if table == 0:
                    following = 0
            second, third = table >> 4, table & 15
            if low == 15:
                a, at = _delta(data, at, end, last)
                last = a
            else:
                a = following
                following += 1
            recent = vertex
            vertices_b = vertices[(recent - second) & 15]
            vertices_c = vertices[(recent - third) & 15]
            b, c = vertices_b, vertices_c
            if second == 0:
                b = following
                following += 1
            if third == 0:
                c = following
                following += 1
            if written and second == 15 and at >= 0:
                b, at = _delta(data, at, end, last)
                last = b
            if written and third == 15 and at >= 0:
                c, at = _delta(data, at, end, last)
                last = c
            vertices[vertex & 15] = a
            vertex += 1
            if second == 0 or (written and second == 15):
                vertices[vertex & 15] = b
                vertex += 1
            if third == 0 or (written and third == 15):
                vertices[vertex & 15] = c
                vertex += 1
            edges[edge & 15, 0], edges[edge & 15, 1] = b, a
            edge += 1
        if at < 0:
            return False
        edges[edge & 15, 0], edges[edge & 15, 1] = c, b
        edges[(edge + 1) & 15, 0], edges[(edge + 1) & 15, 1] = a, c
        edge += 2
        out[3 * k], out[3 * k + 1], out[3 * k + 2] = a, b, c
    return at == end


@inline
def _delta(data: NDArray[Any], at: int, end: int, last: int) -> tuple[int, int]:
    """Read a vertex stored as its difference from the last one; return it and the position after it."""
    value, at = _number(data, at, end)
    return (last + ((value >> 1) ^ -(value & 1))) & _MASK, at
