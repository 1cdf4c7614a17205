"""Images of directions over texture coordinates, as in glTF's KHR_materials_anisotropy.

Red and green are a direction in tangent space, (r, g)·2 − 1: x along the texture's u, y upward in it. Blue is
its weight. All are plain numbers, without a colour profile.

References
----------
The Khronos Group: KHR_materials_anisotropy, https://github.com/KhronosGroup/glTF, extensions/2.0/Khronos;
glTF 2.0, 3.7.2.1, on tangents. There light is spread along the direction, and grooves run at right angles to
it; here rows run along it.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeGuard

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.image.files.read import read_image
from upholster.image.files.write import IMAGE_SUFFIXES
from upholster.image.numbers import to_unit
from upholster.runtime.stages import file_stage

__all__ = ["DirectionImage", "is_direction_image", "read_direction_image"]

_LEAST = 0.02
"""Shorter directions count as none: 8 bits have no exact middle."""


@dataclass(frozen=True, eq=False, slots=True)
class DirectionImage:
    """An image of directions.

    Attributes
    ----------
    name
        Its file.
    along
        (H, W, 2) float64: x along u and y upward; lengths, 0 to 1, are weights.
    """

    name: str
    along: FloatArray

    def at(self, uv: FloatArray) -> FloatArray:
        """Return the image's directions at texture coordinates (…, 2), v downward: (…, 2).

        Beyond 0 to 1 it repeats. It is linear between the centres of pixels; opposite edges are not mixed.
        """
        height, width = self.along.shape[:2]
        own = np.where((uv >= 0) & (uv <= 1), uv, uv % 1.0)
        column = np.clip(own[..., 0] * width - 0.5, 0, width - 1)
        row = np.clip(own[..., 1] * height - 0.5, 0, height - 1)
        left, top = column.astype(np.int64), row.astype(np.int64)
        right, down = (column - left)[..., None], (row - top)[..., None]
        rows = (top, np.minimum(top + 1, height - 1))
        columns = (left, np.minimum(left + 1, width - 1))
        upper, lower = (
            (1 - right) * self.along[at, columns[0]] + right * self.along[at, columns[1]] for at in rows
        )
        found: FloatArray = (1 - down) * upper + down * lower
        return found


def is_direction_image(direction: object) -> TypeGuard[str]:
    """Whether a direction is the name of an image file."""
    return isinstance(direction, str) and Path(direction.strip()).suffix.lower() in IMAGE_SUFFIXES


def _inputs(_: DirectionImage, path: str) -> Iterable[str]:
    return [path]


@file_stage(_inputs)
def read_direction_image(path: str) -> DirectionImage:
    """Read an image of directions.

    Parameters
    ----------
    path
        Red and green are the direction, blue its weight. If blue is missing, or 0 everywhere, all have equal
        weight.

    Raises
    ------
    InputError
        As `upholster.image.files.read.read_image`; if it has one channel, or no direction anywhere.
    """
    unit = to_unit(read_image(path, colors=False))
    if unit.shape[2] == 1:
        raise InputError(f"direction {path!r} is an image of 1 channel; allowed: red and green, or more")
    along = 2.0 * unit[:, :, :2] - 1.0
    length = np.sqrt((along**2).sum(axis=2, keepdims=True))
    strength = unit[:, :, 2:3] if unit.shape[2] > 2 and unit[:, :, 2].any() else 1.0
    along = np.where(length > _LEAST, along * strength / np.maximum(length, _LEAST), 0.0)
    if not along.any():
        raise InputError(f"direction {path!r} is an image that asks for nothing; allowed: one that does")
    return DirectionImage(path, along)
