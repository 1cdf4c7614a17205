"""Array and callback types that every layer shares."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MAX_SAMPLE",
    "FloatArray",
    "IntArray",
    "PixelArray",
    "Progress",
    "frozen_array",
    "int64",
    "uint64",
]

FloatArray = NDArray[np.float64]
"""Geometry and coefficients: always float64."""

IntArray = NDArray[np.int32]
"""Indices."""

PixelArray = NDArray[Any]
"""Samples of shape (height, width, channels): uint8, uint16 or float32, as read."""

Progress = Callable[[str, int, int], None]
"""``progress(stage, done, total)``: called from the main thread, done counts up to total."""


MAX_SAMPLE = 65504.0
"""Largest magnitude of a float sample (that of a half float): squared differences stay far below overflow."""

int64: Any = np.int64
"""For kernels, in which numbers of 64 bits and Python's are the same, but not to the type checker."""

uint64: Any = np.uint64
"""For kernels, of places in arrays: of a number that has no sign compiled code does not ask whether it counts
from the end, which takes as long as all else in a hot loop, and keeps it from taking several at a time."""

Array = TypeVar("Array", bound=NDArray[Any])


def frozen_array(array: Array) -> Array:
    """Return `array` made read-only: the arrays of a frozen dataclass do not change."""
    array.setflags(write=False)
    return array
