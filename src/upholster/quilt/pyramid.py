"""Prefiltered pyramids, from which painting samples where the exemplar is minified (SPEC.md, section 8)."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray, frozen_array

__all__ = ["Pyramid", "build_pyramid", "halved", "most_levels", "next_level", "softened"]


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Images and their softer and smaller levels, one after another, in the layout of the painting kernel.

    Attributes
    ----------
    words
        All levels, pixel by pixel, read-only: float32 samples, or uint64 words of 16-bit lanes (uint8
        samples, four channels a word) or of 32-bit lanes (uint16, two).
    per_pixel
        Words per pixel.
    table
        (images · levels, 4) int64, read-only: each level's first word, height, width and number; all levels
        of the first image, then of the next one. Odd levels that are never read have height 0.
    levels, channels
        Numbers of levels and channels of each image.
    dtype
        Type of the images.
    """

    words: PixelArray
    per_pixel: int
    table: NDArray[np.int64]
    levels: int
    channels: int
    dtype: np.dtype[Any]

    @property
    def bits(self) -> int:
        """Bits of a lane; 32 for float samples."""
        return 16 if self.dtype == np.uint8 else 32


def most_levels(height: int, width: int) -> int:
    """Return the number of the coarsest level of an image of this size, a single pixel (`next_level`)."""
    return 2 * (max(height, width) - 1).bit_length()


def next_level(levels: Sequence[PixelArray]) -> PixelArray:
    """Return the next level of an image, of which `levels` are the first, itself included.

    Level 2k is the image halved k times. Level 2k + 1 is as large as level 2k, with
    details √2 times as wide.
    """
    return softened(levels[-1]) if len(levels) % 2 else halved(levels[-2])


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
    return _filtered(image, 2, (-1, 2), (0, 1))


def softened(image: PixelArray) -> PixelArray:
    """Return an image of the same size, filtered by (1, 6, 1)/8 each way; edges, rounding as in `halved`."""
    return _filtered(image, 1, (-1, 1), (0,))


def _filtered(image: PixelArray, step: int, outer: tuple[int, int], inner: tuple[int, ...]) -> PixelArray:
    # Every `step` pixels, those at the outer distances once and those at the inner ones six times in total.
    whole = image.dtype != np.float32
    part = image.astype(np.int32) if whole else image
    for axis in (0, 1):
        size = part.shape[axis]
        at = step * np.arange(-(-size // step))
        first, last, *middle = (np.take(part, np.clip(at + k, 0, size - 1), axis) for k in outer + inner)
        part = (first + last) + (6 // len(inner)) * sum(middle[1:], middle[0])
    return ((part + 32) >> 6).astype(image.dtype) if whole else part * np.float32(1 / 64)


def build_pyramid(images: Sequence[PixelArray], levels: int, read: Collection[int]) -> Pyramid:
    """Return a pyramid of images: their even levels, and of the odd ones those that are read.

    Parameters
    ----------
    images
        (H, W, C) uint8, uint16 or float32, all of one shape and dtype.
    levels
        The coarsest level, 0 to `most_levels` of the images' size.
    read
        Levels from which placements are painted.
    """
    channels, dtype = images[0].shape[2], images[0].dtype
    lane = np.dtype({1: np.uint16, 2: np.uint32}.get(dtype.itemsize, np.float32))
    in_word = 1 if lane == np.float32 else 8 // lane.itemsize
    per_pixel = -(-channels // in_word)
    parts: list[PixelArray] = []
    table = np.zeros((len(images) * (levels + 1), 4), np.int64)
    table[:, 3] = np.tile(np.arange(levels + 1), len(images))
    start = 0
    for number, image in enumerate(images):
        whole = image
        for level in range(levels + 1):
            if level % 2 and level not in read:
                continue
            whole = halved(whole) if level and level % 2 == 0 else whole
            shown = softened(whole) if level % 2 else whole
            table[number * (levels + 1) + level, :3] = start, *shown.shape[:2]
            lanes = np.zeros((*shown.shape[:2], per_pixel * in_word), lane)
            lanes[:, :, :channels] = shown
            part = lanes.reshape(-1)
            parts.append(part if lane == np.float32 else part.view(np.uint64))
            start += len(parts[-1])
    words = frozen_array(np.concatenate(parts))
    return Pyramid(words, per_pixel, frozen_array(table), levels + 1, channels, dtype)
