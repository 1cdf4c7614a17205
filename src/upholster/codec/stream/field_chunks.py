"""The chunks of warp fields: maps from steps to the exemplar, coarse to fine (SPEC.md, sections 3, 5.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream import _node_kernels as kernels
from upholster.codec.stream.bit_coder import BitReader, BitWriter
from upholster.codec.stream.byte_reader import ByteReader, varint
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import MOST_OCTAVES, MOST_SHEAR, OCTAVE, WarpField, node_count

__all__ = ["MAX_NODES", "FieldCode", "FieldDecoder", "pack_fields"]

MAX_NODES = 2**21
"""Largest number of nodes over all charts."""

_MOST_MARGIN, _MOST_SIDE = 64, 1024
_LIMITS = np.array([OCTAVE * MOST_OCTAVES, OCTAVE * MOST_OCTAVES, 0, MOST_SHEAR])
_PLAIN, _COVERING, _SHAPED = 0, 1, 2
_STRIDES = kernels.COARSEST, 2, 1
_NODE_ROOM = 160
"""Largest number of bytes of a node: four numbers of 21 bits, each of which takes 12 at worst, and some."""


@dataclass(frozen=True, slots=True)
class FieldCode:
    """Warp fields as bytes.

    Attributes
    ----------
    head
        The grids of nodes.
    nodes
        The nodes, from coarse to fine.
    coarse
        Number of bytes of `nodes` for the coarse ones, about.
    """

    head: bytes
    nodes: bytes
    coarse: int


def pack_fields(fields: Sequence[WarpField], charts: Sequence[Chart]) -> FieldCode:
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
    kinds_of_all = bytes([alike, margin]) + (bytes(kinds) if alike == 3 else b"")
    nodes = [np.array(field.nodes) for field in fields if not field.is_identity]
    writer, coarse = BitWriter(kernels.NODE_COUNTERS), 0
    left = np.zeros(4, np.int64)
    for stride in _STRIDES:
        first = np.zeros(4, np.int16)
        for own in nodes:
            size = kernels.stage_size(own.shape[0], own.shape[1], stride)
            writer.room(_NODE_ROOM * size)
            kernels.code_nodes(writer.coder, own, first, left, (stride, 0, size), _LIMITS, True)
            first = own[0, 0]
        coarse = coarse or writer.length
    coded = writer.finish()
    return FieldCode(kinds_of_all + bytes(head), coded, min(coarse, len(coded)))


class FieldDecoder:
    """Decodes the nodes of warp fields as their bytes arrive, from coarse to fine over all charts.

    Parameters
    ----------
    head
        The grids of nodes.
    charts
        The layout.

    Raises
    ------
    FormatError
        If it is malformed or not allowed.
    """

    def __init__(self, head: ByteReader, charts: Sequence[Chart]) -> None:
        alike = head.byte("kinds of fields", 3)
        margin = head.byte("margin of the fields", _MOST_MARGIN)
        kinds = [head.byte("kind of a field", _SHAPED) if alike == 3 else alike for _ in charts]
        self._shapes: list[tuple[int, int, int]] = []
        total = 0
        for kind, chart in zip(kinds, charts, strict=True):
            shape = (0, 0, 0)
            if kind == _COVERING:
                shape = (margin, *_covering(chart, margin))
            elif kind == _SHAPED:
                shape = (
                    head.varint("margin of a field", _MOST_MARGIN),
                    head.varint("rows of nodes", _MOST_SIDE, 1),
                    head.varint("columns of nodes", _MOST_SIDE, 1),
                )
            total += shape[1] * shape[2]
            self._shapes.append(shape)
        if total > MAX_NODES:
            raise head.error(f"fields have {total} nodes; allowed: {MAX_NODES}")
        head.end("head of the fields")
        self._reader = BitReader(kernels.NODE_COUNTERS)
        self._nodes = [np.zeros((*shape[1:], 4), np.int16) for shape in self._shapes if shape[1]]
        self._stages = [
            (stride, n, kernels.stage_size(nodes.shape[0], nodes.shape[1], stride))
            for stride in _STRIDES
            for n, nodes in enumerate(self._nodes)
        ]
        self._left = np.zeros(4, np.int64)
        self._stage = self._done = 0
        self._fields: tuple[WarpField, ...] | None = None

    @property
    def unread(self) -> int:
        """Received bytes that no symbol has needed."""
        return self._reader.unread

    @property
    def complete(self) -> bool:
        """Whether all fields are known."""
        return self._stage == len(self._stages)

    @property
    def fields(self) -> tuple[WarpField, ...]:
        """The field of each chart; nodes that have not arrived have their predictions."""
        if self._fields is None:
            start = self._done
            for stride, n, size in self._stages[self._stage :]:
                kernels.guess_nodes(self._nodes[n], self._first(n), stride, start, size)
                start = 0
            nodes = iter(self._nodes)
            self._fields = tuple(
                WarpField(next(nodes).copy(), shape[0]) if shape[1] else WarpField.identity()
                for shape in self._shapes
            )
        return self._fields

    def feed(self, data: bytes) -> None:
        """Take further bytes of the nodes.

        Raises
        ------
        FormatError
            If a node is out of range.
        """
        self._reader.feed(data)
        self._fields = None
        while self._stage < len(self._stages):
            stride, n, size = self._stages[self._stage]
            stage = stride, self._done, size
            done = kernels.code_nodes(
                self._reader.coder, self._nodes[n], self._first(n), self._left, stage, _LIMITS, False
            )
            if done < 0:
                raise FormatError("a field's node is out of range")
            self._done = done
            if done < size:
                return
            self._stage, self._done = self._stage + 1, 0

    def _first(self, n: int) -> NDArray[np.int16]:
        # Prediction of a field's first node.
        found: NDArray[np.int16] = self._nodes[n - 1][0, 0].copy() if n else np.zeros(4, np.int16)
        return found


def _covering(chart: Chart, margin: int) -> tuple[int, int]:
    return node_count(chart.height, margin), node_count(chart.width, margin)
