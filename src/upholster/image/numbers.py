"""Samples as numbers: the value that stands for 1 in maps that hold no colours."""

from typing import Any

import numpy as np

from upholster.base.types import FloatArray, PixelArray

__all__ = ["as_depth", "to_unit", "top_of"]


def top_of(dtype: np.dtype[Any]) -> int:
    """Return the value that stands for 1 in samples that are plain numbers."""
    return 1 if dtype.kind == "f" else int(np.iinfo(dtype).max)


def to_unit(pixels: PixelArray) -> FloatArray:
    """Return samples as numbers, 0 to 1."""
    values: FloatArray = np.clip(pixels / top_of(pixels.dtype), 0.0, 1.0, dtype=np.float64)
    return values


def as_depth(pixels: PixelArray, dtype: np.dtype[Any]) -> PixelArray:
    """Return plain numbers in another depth."""
    if pixels.dtype == dtype:
        return pixels
    unit = to_unit(pixels)
    depth: PixelArray = (unit if dtype.kind == "f" else np.rint(unit * top_of(dtype))).astype(dtype)
    return depth
