"""What method "quilt" compares blocks by: the exemplar's features and their boxes' means, level by level."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.methods.quilt._search_kernels import mean_boxes
from upholster.methods.quilt.features import pca_features
from upholster.quilt.pyramid import halved
from upholster.types import PixelArray

__all__ = ["MatchLevel", "MatchPyramid"]


@dataclass(frozen=True, eq=False, slots=True)
class MatchLevel:
    """One level: `image` (height · width · channels) and its boxes' means, see `mean_boxes`, by `step`."""

    height: int
    width: int
    channels: int
    step: int
    image: NDArray[np.uint8]
    plane: NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class MatchPyramid:
    """All levels that blocks are compared on.

    Attributes
    ----------
    levels
        From the finest on.
    variance
        Of the finest level's pixels, see `pca_features`.
    usage_step
        Pixels of the finest level between two points of the usage grid, on which usage is counted.
    """

    levels: tuple[MatchLevel, ...]
    variance: float
    usage_step: int

    @classmethod
    def of(cls, exemplar: PixelArray, last: int = 0) -> "MatchPyramid":
        """Make the levels of an exemplar (H, W, C), from 0 to `last`."""
        form, variance = pca_features(exemplar)
        image = form
        levels = []
        for level in range(last + 1):
            if level:
                image = halved(image)
            height, width, channels = image.shape
            flat = np.ascontiguousarray(image).reshape(-1)
            step = _step(height, width)
            plane = mean_boxes(flat, height, width, channels, step)
            levels.append(MatchLevel(height, width, channels, step, flat, plane))
        usage_step = max(4, 1 << (len(levels) - 1))
        while max(form.shape[:2]) > 64 * usage_step:
            usage_step *= 2
        return cls(tuple(levels), variance, usage_step)

    def stride(self, level: int) -> int:
        """Return the distance of the usage grid's points in pixels of a level."""
        return self.usage_step >> level

    def empty_usage(self, symmetries: int = 1) -> NDArray[np.float64]:
        """Return usage grids of zeros, one below the other for so many symmetries: nothing is used yet."""
        first = self.levels[0]
        rows, columns = -(-first.height // self.usage_step), -(-first.width // self.usage_step)
        return np.zeros((symmetries * rows, columns))


def _step(height: int, width: int) -> int:
    # Candidates are every step-th pixel each way: boxes' means change little from one to the next.
    area = height * width
    return 1 if area <= 64 * 64 else 2 if area <= 384 * 384 else 4
