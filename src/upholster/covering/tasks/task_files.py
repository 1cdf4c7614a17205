"""The files that tasks pass on, as bytes: a parcel's blocks, pieces of charts' labels, and charts."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.quilt.labels import LabelMap
from upholster.quilt.placement import PLACEMENT
from upholster.synthesis.quilt.emit import Labelled, LabelPiece
from upholster.synthesis.quilt.laid_blocks import ParcelBlocks

__all__ = [
    "blocks_bytes",
    "chart_bytes",
    "piece_bytes",
    "read_blocks",
    "read_chart",
    "read_piece",
]

_BLOCKS = ("numbers", "steps", "spots", "records", "masks")
_PIECE = ("labels", "away", "numbers", "records", "fits")


def chart_bytes(chart: Labelled) -> bytes:
    """Return a chart's placements and labels as a file."""
    placed, layer = chart
    return _file(
        {"placements": placed.view(np.uint8), "labels": layer.labels, "cell": np.array([layer.cell])}
    )


def read_chart(data: bytes) -> Labelled:
    """Read the result of `chart_bytes`."""
    found = _read(data)
    return found["placements"].view(PLACEMENT), LabelMap(int(found["cell"][0]), found["labels"])


def blocks_bytes(blocks: ParcelBlocks) -> bytes:
    """Return a parcel's blocks as a file."""
    return _file({name: getattr(blocks, name) for name in _BLOCKS})


def read_blocks(data: bytes) -> ParcelBlocks:
    """Read the result of `blocks_bytes`."""
    found = _read(data)
    numbers, steps, spots, records, masks = (found[name] for name in _BLOCKS)
    return ParcelBlocks(numbers, steps, spots, records, masks)


def piece_bytes(piece: LabelPiece) -> bytes:
    """Return a piece of a chart's labels as a file."""
    where = np.array([piece.chart, *piece.corner], np.int64)
    return _file({"where": where, **{name: getattr(piece, name) for name in _PIECE}})


def read_piece(data: bytes) -> LabelPiece:
    """Read the result of `piece_bytes`."""
    found = _read(data)
    chart, row, column = found["where"].tolist()
    return LabelPiece(chart, (row, column), *(found[name] for name in _PIECE))


def _file(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays as a line of JSON, which describes them, and their bytes one after another.

    NumPy's own files take a hundred times as long to open, and tasks read many.
    """
    head = json.dumps([(name, array.dtype.str, array.shape) for name, array in arrays.items()])
    parts = [np.ascontiguousarray(array).tobytes() for array in arrays.values()]
    return b"".join([head.encode(), b"\n", *parts])


def _read(data: bytes) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    start = data.index(b"\n") + 1
    for name, dtype, shape in json.loads(data[:start]):
        count = math.prod(shape)
        array: NDArray[Any] = np.frombuffer(data, dtype, count, start)
        found[name] = array.reshape(shape).copy()
        start += array.nbytes
    return found
