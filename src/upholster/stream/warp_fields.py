"""The chunk of warp fields: how texels lie over the exemplar, chart after chart (SPEC.md, "warp fields")."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart
from upholster.quilt.warp_field import MOST_OCTAVES, MOST_SHEAR, OCTAVE, WarpField, node_count
from upholster.stream import _node_kernels as kernels
from upholster.stream.byte_reader import ByteReader, varint
from upholster.stream.coder import BitReader, BitWriter

__all__ = ["MAX_NODES", "pack_fields", "parse_fields"]

MAX_NODES = 2**21
"""Nodes over all charts."""

_MOST_MARGIN, _MOST_SIDE = 64, 1024
_LIMITS = np.array([OCTAVE * MOST_OCTAVES, OCTAVE * MOST_OCTAVES, 0, MOST_SHEAR])
_PLAIN, _COVERING, _SHAPED = 0, 1, 2


def pack_fields(fields: Sequence[WarpField], charts: Sequence[Chart]) -> bytes:
    """Return the charts' warp fields as bytes.

    Raises
    ------
    InputError
        For more than 2^21 nodes, or more than 1024 each way on a chart.
    """
    kinds, head = [], bytearray()
    margin = next((field.margin for field in fields if not field.is_identity), 0)
    total = 0
    for n, (field, chart) in enumerate(zip(fields, charts, strict=True)):
        if field.is_identity:
            kinds.append(_PLAIN)
            continue
        rows, columns = field.nodes.shape[:2]
        if max(rows, columns) > _MOST_SIDE:
            raise InputError(
                f"field {n} has {rows}×{columns} nodes; allowed: {_MOST_SIDE} each way in a stream"
            )
        total += rows * columns
        laid = field.margin == margin and (rows, columns) == _covering(chart, margin)
        kinds.append(_COVERING if laid else _SHAPED)
        head += b"" if laid else varint(field.margin) + varint(rows) + varint(columns)
    if total > MAX_NODES:
        raise InputError(f"fields have {total} nodes; allowed: {MAX_NODES} in a stream")
    alike = kinds[0] if len(set(kinds)) == 1 else 3
    writer = BitWriter(kernels.NODE_COUNTERS, kernels.NODE_INPUTS)
    first = np.zeros(4, np.int16)
    for field in fields:
        if not field.is_identity:
            writer.room(16 * field.nodes.size + 64)
            nodes = np.array(field.nodes)
            kernels.code_nodes(writer.coder, nodes, first, _LIMITS, True)
            first = nodes[0, 0].copy()
    told = bytes([alike, margin]) + (bytes(kinds) if alike == 3 else b"")
    return told + bytes(head) + writer.finish()


def parse_fields(fields: ByteReader, charts: Sequence[Chart]) -> tuple[WarpField, ...]:
    """Read the charts' warp fields back.

    Raises
    ------
    FormatError
        If they are malformed or outside what is allowed.
    """
    alike = fields.byte("kinds of fields", 3)
    margin = fields.byte("margin of the fields", _MOST_MARGIN)
    kinds = [fields.byte("kind of a field", _SHAPED) if alike == 3 else alike for _ in charts]
    shapes: list[tuple[int, int, int] | None] = []
    total = 0
    for kind, chart in zip(kinds, charts, strict=True):
        if kind == _PLAIN:
            shapes.append(None)
            continue
        if kind == _COVERING:
            told = (margin, *_covering(chart, margin))
        else:
            told = (
                fields.varint("margin of a field", _MOST_MARGIN),
                fields.varint("rows of nodes", _MOST_SIDE, 1),
                fields.varint("columns of nodes", _MOST_SIDE, 1),
            )
        total += told[1] * told[2]
        shapes.append(told)
    if total > MAX_NODES:
        raise fields.error(f"fields have {total} nodes; allowed: {MAX_NODES}")
    coded = fields.offset
    reader = BitReader(kernels.NODE_COUNTERS, kernels.NODE_INPUTS)
    reader.feed(fields.bytes(fields.left, "nodes"))
    first = np.zeros(4, np.int16)
    found: list[WarpField] = []
    for shape in shapes:
        if shape is None:
            found.append(WarpField.identity())
            continue
        nodes: NDArray[np.int16] = np.zeros((*shape[1:], 4), np.int16)
        done = kernels.code_nodes(reader.coder, nodes, first, _LIMITS, False)
        if done <= 0:
            raise FormatError(
                f"byte {coded}: "
                + ("a field's node is out of range" if done else "nodes of a field are missing")
            )
        first = nodes[0, 0].copy()
        found.append(WarpField(nodes, shape[0]))
    if reader.unread:
        raise FormatError(f"byte {coded}: {reader.unread} bytes too many in the fields")
    return tuple(found)


def _covering(chart: Chart, margin: int) -> tuple[int, int]:
    return node_count(chart.height, margin), node_count(chart.width, margin)
