"""Prefiltered pyramids: what painting samples where the exemplar is minified (SPEC.md, section 8)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.types import PixelArray, frozen_array

__all__ = ["Pyramid", "build_pyramid", "halved", "most_levels"]


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Images and their smaller levels, laid out for the kernels that paint from them.

    A level keeps one pixel more each way, a copy of its rim, so that the right and the lower neighbour of any
    of its pixels can be read.

    Attributes
    ----------
    words
        All levels, one after another, read-only: float32 samples, or uint64 words of 16-bit lanes (uint8
        samples, four channels a word) or 32-bit lanes (uint16, two).
    per_pixel
        Words that a pixel takes.
    lane
        dtype of a lane of the canvas: uint16, uint32 or float32.
    levels
        (images · levels, 5) int64, read-only: each level's first word, words per row, last row, last column
        and number; all levels of the first image, then of the next one.
    """

    words: PixelArray
    per_pixel: int
    lane: np.dtype[Any]
    levels: NDArray[np.int64]


def most_levels(height: int, width: int) -> int:
    """Return how often an image of this size can be halved until a single pixel is left."""
    return (max(height, width) - 1).bit_length()


def halved(image: PixelArray) -> PixelArray:
    """Return an image of half the size, prefiltered by (1, 3, 3, 1)/8 down the columns, then along the rows.

    Parameters
    ----------
    image
        (H, W, C) uint8, uint16 or float32. Its edges repeat.

    Returns
    -------
    ndarray
        (⌈H/2⌉, ⌈W/2⌉, C) of the same dtype; pixel i covers pixels 2i and 2i + 1. Integers are rounded once.
    """
    whole = image.dtype != np.float32
    part = image.astype(np.int32) if whole else image
    for axis in (0, 1):
        size = part.shape[axis]
        at = 2 * np.arange((size + 1) // 2)
        before, middle, after, behind = (
            np.take(part, np.clip(at + k, 0, size - 1), axis) for k in (-1, 0, 1, 2)
        )
        part = (before + behind) + 3 * (middle + after)
    return ((part + 32) >> 6).astype(image.dtype) if whole else part * np.float32(1 / 64)


def build_pyramid(images: Sequence[PixelArray], levels: int) -> Pyramid:
    """Lay out images and `levels` halved ones of each.

    Parameters
    ----------
    images
        (H, W, C) uint8, uint16 or float32, all of one shape and dtype.
    levels
        0 to `most_levels` of their size.
    """
    channels = images[0].shape[2]
    lane = np.dtype({1: np.uint16, 2: np.uint32}.get(images[0].itemsize, np.float32))
    in_word = 1 if lane == np.float32 else 8 // lane.itemsize
    per_pixel = -(-channels // in_word)
    parts: list[PixelArray] = []
    table = np.empty((len(images) * (levels + 1), 5), np.int64)
    start = 0
    for number, image in enumerate(images):
        for level in range(levels + 1):
            image = halved(image) if level else image
            height, width = image.shape[:2]
            padded = np.zeros((height + 1, width + 1, per_pixel * in_word), lane)
            padded[:height, :width, :channels] = image
            padded[height], padded[:, width] = padded[height - 1], padded[:, width - 1]
            part = padded.reshape(-1)
            parts.append(part if lane == np.float32 else part.view(np.uint64))
            row = table[number * (levels + 1) + level]
            row[:] = start, (width + 1) * per_pixel, height - 1, width - 1, level
            start += len(parts[-1])
    return Pyramid(frozen_array(np.concatenate(parts)), per_pixel, lane, frozen_array(table))
