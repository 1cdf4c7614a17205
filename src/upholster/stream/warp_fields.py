"""The chunk of warp fields: how texels lie over the exemplar, chart after chart (SPEC.md, "warp fields")."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.errors import FormatError, InputError
from upholster.quilt import Chart
from upholster.quilt.warp_field import MOST_OCTAVES, MOST_SHEAR, OCTAVE, WarpField, node_count
from upholster.stream import _node_kernels as kernels
from upholster.stream.byte_reader import ByteReader, varint
from upholster.stream.coder import BitReader, BitWriter

__all__ = ["MAX_NODES", "FieldCode", "FieldDecoder", "pack_fields"]

MAX_NODES = 2**21
"""Nodes over all charts."""

_MOST_MARGIN, _MOST_SIDE = 64, 1024
_LIMITS = np.array([OCTAVE * MOST_OCTAVES, OCTAVE * MOST_OCTAVES, 0, MOST_SHEAR])
_PLAIN, _COVERING, _SHAPED = 0, 1, 2


@dataclass(frozen=True, slots=True)
class FieldCode:
    """Warp fields as bytes.

    Attributes
    ----------
    head
        What is told of the nodes' grids.
    nodes
        The nodes, chart after chart.
    ends
        Per chart how many bytes of `nodes` tell the charts' up to it, about.
    """

    head: bytes
    nodes: bytes
    ends: tuple[int, ...]


def pack_fields(fields: Sequence[WarpField], charts: Sequence[Chart]) -> FieldCode:
    """Return the charts' warp fields as bytes, their nodes chart after chart.

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
    first, ends = np.zeros(4, np.int16), []
    for field in fields:
        if not field.is_identity:
            nodes = np.array(field.nodes)
            writer.room(16 * nodes.size + 64)
            kernels.code_nodes(writer.coder, nodes, np.zeros_like(nodes), first, _LIMITS, 0, True)
            first = nodes[0, 0].copy()
        ends.append(writer.length)
    told = bytes([alike, margin]) + (bytes(kinds) if alike == 3 else b"")
    coded = writer.finish()
    return FieldCode(told + bytes(head), coded, (*(min(end, len(coded)) for end in ends[:-1]), len(coded)))


class FieldDecoder:
    """Decodes the nodes of warp fields as their bytes arrive, chart after chart.

    Attributes
    ----------
    fields
        Per chart its field; None while its nodes are not known.

    Parameters
    ----------
    head
        What is told of the nodes' grids.
    charts
        The layout.

    Raises
    ------
    FormatError
        If it is malformed or outside what is allowed.
    """

    def __init__(self, head: ByteReader, charts: Sequence[Chart]) -> None:
        alike = head.byte("kinds of fields", 3)
        margin = head.byte("margin of the fields", _MOST_MARGIN)
        kinds = [head.byte("kind of a field", _SHAPED) if alike == 3 else alike for _ in charts]
        self.fields: list[WarpField | None] = []
        self._shapes: list[tuple[int, int, int]] = []
        total = 0
        for kind, chart in zip(kinds, charts, strict=True):
            told = (0, 0, 0)
            if kind == _COVERING:
                told = (margin, *_covering(chart, margin))
            elif kind == _SHAPED:
                told = (
                    head.varint("margin of a field", _MOST_MARGIN),
                    head.varint("rows of nodes", _MOST_SIDE, 1),
                    head.varint("columns of nodes", _MOST_SIDE, 1),
                )
            total += told[1] * told[2]
            self._shapes.append(told)
            self.fields.append(WarpField.identity() if kind == _PLAIN else None)
        if total > MAX_NODES:
            raise head.error(f"fields have {total} nodes; allowed: {MAX_NODES}")
        head.end("head of the fields")
        self._reader = BitReader(kernels.NODE_COUNTERS, kernels.NODE_INPUTS)
        self._waiting = deque(n for n, field in enumerate(self.fields) if field is None)
        self._first = np.zeros(4, np.int16)
        self._done = 0
        self._begin()

    @property
    def unread(self) -> int:
        """Bytes that came and that no symbol needed."""
        return self._reader.unread

    @property
    def complete(self) -> bool:
        """Whether every field is known."""
        return not self._waiting

    def feed(self, data: bytes) -> None:
        """Take further bytes of the nodes.

        Raises
        ------
        FormatError
            If a node is out of range.
        """
        self._reader.feed(data)
        while self._waiting:
            nodes = self._nodes
            done = kernels.code_nodes(
                self._reader.coder, nodes, self._left, self._first, _LIMITS, self._done, False
            )
            if done < 0:
                raise FormatError("a field's node is out of range")
            self._done = done
            if done < nodes.size:
                return
            n = self._waiting.popleft()
            self.fields[n] = WarpField(nodes, self._shapes[n][0])
            self._first = nodes[0, 0].copy()
            self._begin()

    def _begin(self) -> None:
        shape = self._shapes[self._waiting[0]][1:] if self._waiting else (0, 0)
        self._nodes: NDArray[np.int16] = np.zeros((*shape, 4), np.int16)
        self._left = np.zeros_like(self._nodes)
        self._done = 0


def _covering(chart: Chart, margin: int) -> tuple[int, int]:
    return node_count(chart.height, margin), node_count(chart.width, margin)
