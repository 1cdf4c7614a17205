"""A material's maps as image files of their own, named by role, next to the base colour's file."""

import os
from pathlib import Path

import numpy as np

from upholster.base.formats import UDIM
from upholster.base.types import PixelArray
from upholster.image.files.write import write_image
from upholster.image.numbers import as_depth
from upholster.image.roles import COLORS
from upholster.output.export.pbr import DATA_QUALITY

__all__ = ["map_companion", "write_map"]


def map_companion(path: str | os.PathLike[str], role: str) -> Path:
    """Return the file of a map for the base colour's file `path`: ``wall_normal.png`` for ``wall.png``.

    For ``wall.<UDIM>.png`` it is ``wall_normal.<UDIM>.png``.
    """
    target = Path(path)
    before, tile, after = target.name.partition(UDIM)
    if tile:
        stem = before.rstrip("._-")
        return target.with_name(f"{stem}_{role}{before[len(stem) :]}{tile}{after}")
    return target.with_name(f"{target.stem}_{role}{target.suffix}")


def write_map(path: str | os.PathLike[str], role: str, pixels: PixelArray, *, quality: int = 90) -> None:
    """Write a map as an image file, without applying a colour curve to plain numbers.

    Parameters
    ----------
    path
        As for `upholster.image.files.write.write_image`.
    role
        Albedo and emission are colours, written like any image; for the others the stored numbers count.
    pixels
        (H, W, C) uint8, uint16 or float32, see `upholster.image.files.material.Material`. Plain numbers in
        float become 16-bit if the format holds integers. All of them become float32 in EXR, where 1 stands
        for the largest integer.
    quality
        1 to 100, for JPEG and WebP; maps other than colours get at least 90.

    Raises
    ------
    InputError
        As for `upholster.image.files.write.write_image`.
    """
    if role in COLORS:
        write_image(path, pixels, quality=quality)
        return
    dtype = pixels.dtype
    if Path(path).suffix.lower() == ".exr":
        dtype = np.dtype(np.float32)
    elif dtype.kind == "f":
        dtype = np.dtype(np.uint16)
    write_image(path, as_depth(pixels, dtype), quality=max(quality, DATA_QUALITY))
