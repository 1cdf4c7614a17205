"""The bytes of what a chart leaves: placements and labels, and its overhang, with what others are told."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt.emit import Labelled

ShownBlocks = object
BLOCK = object
LaidPart = object
ChartPlacements = object
from upholster.quilt.labels import LabelMap
from upholster.quilt.placement import PLACEMENT
from upholster.types import FloatArray

__all__ = ["chart_bytes", "part_bytes", "read_chart", "read_part", "read_state", "state_bytes"]

_Arrays = Mapping[str, NDArray[Any]]


def chart_bytes(chart: Labelled) -> bytes:
    """Return a chart's placements and labels as a file."""
    placed, layer = chart
    return _file(
        {"placements": placed.view(np.uint8), "labels": layer.labels, "cell": np.array([layer.cell])}
    )


def read_chart(data: bytes) -> Labelled:
    """Read what `chart_bytes` wrote."""
    found = _read(data)
    return found["placements"].view(PLACEMENT), LabelMap(int(found["cell"][0]), found["labels"])


def part_bytes(part: LaidPart) -> bytes:
    """Return what a chart leaves to others as a file."""
    own = {"places": part.shown.places, "shown": part.shown.shown, "usage": part.usage}
    return _file({**_arrays_of(part.overhang), **own, "count": np.array([part.placements], np.int64)})


def read_part(data: bytes) -> LaidPart:
    """Read what `part_bytes` wrote."""
    found = _read(data)
    shown = ShownBlocks(found["places"], found["shown"])
    return LaidPart(_laid(found), shown, found["usage"], int(found["count"][0]))


def state_bytes(usage: FloatArray, shown: Sequence[ShownBlocks | None]) -> bytes:
    """Return usage and what is shown before a class begins as a file."""
    known = [(n, part) for n, part in enumerate(shown) if part is not None]
    return _file(
        {
            "usage": usage,
            "charts": np.array([n for n, _ in known], np.int64),
            "counts": np.array([len(part.shown) for _, part in known], np.int64),
            "places": np.concatenate([np.zeros((0, 3)), *(part.places for _, part in known)]),
            "shown": np.concatenate([np.zeros(0, np.int64), *(part.shown for _, part in known)]),
        }
    )


def read_state(data: bytes, charts: int) -> tuple[FloatArray, list[ShownBlocks | None]]:
    """Read what `state_bytes` wrote of a layout of so many charts."""
    found = _read(data)
    shown: list[ShownBlocks | None] = [None] * charts
    start = 0
    for n, count in zip(found["charts"].tolist(), found["counts"].tolist(), strict=True):
        part = slice(start, start + count)
        shown[n] = ShownBlocks(found["places"][part], found["shown"][part])
        start += count
    return found["usage"], shown


def _arrays_of(laid: ChartPlacements) -> dict[str, NDArray[Any]]:
    return {
        "placements": np.ascontiguousarray(laid.placements).view(np.uint8),
        "cells": np.packbits(laid.cells),
        "origins": laid.origins,
        "steps": laid.steps,
        "numbers": np.array([len(laid.cells), *laid.bounds], np.int64),
    }


def _laid(found: _Arrays) -> ChartPlacements:
    cells, top, bottom, left, right = found["numbers"].tolist()
    return ChartPlacements(
        found["placements"].view(BLOCK),
        np.unpackbits(found["cells"], count=cells),
        found["origins"],
        found["steps"],
        (top, bottom, left, right),
    )


def _file(arrays: _Arrays) -> bytes:
    """Return arrays as a line of JSON, which tells what they are, and their bytes one after another.

    NumPy's own files take a hundred times as long to open, and a chart reads those of all its neighbours.
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
