"""Array and callback types that every layer shares."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MAX_SAMPLE",
    "ComplexArray",
    "FloatArray",
    "IntArray",
    "PixelArray",
    "Progress",
    "frozen_array",
    "int64",
    "uint64",
]

ComplexArray = NDArray[np.complex128]
"""Directions in planes, phases, and their powers."""

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
"""For kernels, in which 64-bit numbers and Python's are the same, although not to the type checker."""

uint64: Any = np.uint64
"""For indices in kernels: compiled code does not test whether an unsigned number counts from the end. In a
hot loop that test takes as long as everything else, and prevents vectorization."""

Array = TypeVar("Array", bound=NDArray[Any])


def frozen_array(array: Array) -> Array:
    """Return `array` made read-only: the arrays of a frozen dataclass do not change."""
    array.setflags(write=False)
    return array
