"""What method "quilt" compares blocks by: the exemplar's features and their boxes' means, level by level."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.elements import Joints, Lattice
from upholster.image.masks import Used
from upholster.methods.quilt._block_kernels import MatchImage
from upholster.methods.quilt._search_kernels import mean_boxes
from upholster.methods.quilt.features import match_features
from upholster.methods.quilt.phases import level_phases, shown_waves
from upholster.quilt.pyramid import halved
from upholster.stages import stage
from upholster.types import PixelArray

__all__ = ["MatchLevel", "MatchPyramid", "match_pyramid"]


_EVERYWHERE = (np.empty(0, np.uint8), np.empty(0, np.int64))
_UNGUIDED = (np.empty((0, 0), np.uint8), np.empty((0, 256), np.int32))


@dataclass(frozen=True, eq=False, slots=True)
class MatchLevel:
    """One level: its size, the pixels between two candidates, and what kernels know of it."""

    height: int
    width: int
    step: int
    match: MatchImage


@dataclass(frozen=True, eq=False, slots=True)
class MatchPyramid:
    """All levels that blocks are compared on.

    Attributes
    ----------
    levels
        From the finest on.
    form
        What the finest level's pixels are compared by, (H, W, K).
    variance
        Mean squared distance of the finest level's pixels from their mean, of those that are used.
    usage_step
        Pixels of the finest level between two points of the usage grid, on which usage is counted.
    """

    levels: tuple[MatchLevel, ...]
    form: NDArray[np.uint8]
    variance: float
    usage_step: int

    def stride(self, level: int) -> int:
        """Return the distance of the usage grid's points in pixels of a level."""
        return self.usage_step >> level

    def empty_usage(self, symmetries: int = 1) -> NDArray[np.float64]:
        """Return usage grids of zeros, one below the other for so many symmetries: nothing is used yet."""
        first = self.levels[0]
        rows, columns = -(-first.height // self.usage_step), -(-first.width // self.usage_step)
        return np.zeros((symmetries * rows, columns))


@stage
def match_pyramid(
    exemplar: PixelArray,
    last: int = 0,
    lattice: Lattice | None = None,
    joints: Joints | None = None,
    used: Used | None = None,
) -> MatchPyramid:
    """Make the levels of an exemplar (H, W, C), from 0 to `last`.

    Its phases and its joints are told where they count: see `_with_joints`.
    `used` (H, W) tells what of it varies; None: all.
    """
    shown = shown_waves(lattice)
    form = match_features(exemplar, most=4 if joints is None else 3)
    if joints is not None:
        form = np.concatenate([_with_joints(form[..., 0], joints)[..., None], form], axis=2)
    varying = form if used is None else form[used][None]
    variance = float(varying.astype(np.float64).var(axis=(0, 1)).sum())
    image = form
    levels = []
    for level in range(last + 1):
        if level:
            image = halved(image)
        height, width = image.shape[:2]
        step = _step(height, width)
        plane = mean_boxes(np.ascontiguousarray(image[..., 0]), step)
        phases = level_phases(lattice, level, height, width)
        match = MatchImage(_as_pixels(image), plane, phases, shown, *_EVERYWHERE, *_UNGUIDED)
        levels.append(MatchLevel(height, width, step, match))
    usage_step = max(4, 1 << (len(levels) - 1))
    while max(form.shape[:2]) > 64 * usage_step:
        usage_step *= 2
    return MatchPyramid(tuple(levels), form, variance, usage_step)


def _with_joints(first: NDArray[np.uint8], joints: Joints) -> NDArray[np.uint8]:
    # The channel by which candidates are found: the mean of the first colour and of how far pixels are from
    # joints, or how near, whichever agrees with the colour.
    color, far = first.astype(np.int64), joints.distances.astype(np.int64)
    if ((color - int(color.mean())) * (far - int(far.mean()))).sum() < 0:
        far = 255 - far
    return ((color + far) // 2).astype(np.uint8)


def _as_pixels(image: NDArray[np.uint8]) -> NDArray[np.int32]:
    # An image of at most four channels as one number for each pixel.
    pixels = np.zeros((*image.shape[:2], 4), np.uint8)
    pixels[..., : image.shape[2]] = image
    return pixels.view("<i4").astype(np.int32, copy=False).reshape(-1)


def _step(height: int, width: int) -> int:
    # Candidates are every step-th pixel each way: boxes' means change little from one to the next.
    area = height * width
    return 1 if area <= 64 * 64 else 2 if area <= 384 * 384 else 4
