"""A contact sheet: the first picture of each job of a batch, with its name."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from upholster.base.errors import UpholsterError
from upholster.base.files import outputs
from upholster.base.types import PixelArray
from upholster.image.color import from_linear, to_linear
from upholster.image.drawing import Drawing
from upholster.image.files.read import read_image
from upholster.image.files.write import IMAGE_SUFFIXES, write_image
from upholster.image.resize import resize_image

__all__ = ["write_sheet"]

_CELL, _LABEL, _GAP = 240, 40, 12
_COLUMNS = 8
_LONGEST = 34
_MOST = 1000
"""Pictures on a sheet: 30 megapixels."""


def write_sheet(path: Path, pictures: Sequence[tuple[str, Sequence[str]]]) -> int:
    """Write a contact sheet; return how many jobs are on it.

    Parameters
    ----------
    path
        The image to write.
    pictures
        For each job its name, and the files that it wrote: the first image is shown. Jobs without an image,
        and all after the thousandth, are left out.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    shown: list[tuple[str, str]] = []
    for name, files in pictures:
        image = next((file for file in files if Path(file).suffix.lower() in IMAGE_SUFFIXES), None)
        if image is not None and len(shown) < _MOST:
            shown.append((name, image))
    columns = min(_COLUMNS, max(1, len(shown)))
    rows = max(1, -(-len(shown) // columns))
    width, height = _CELL + _GAP, _CELL + _LABEL
    sheet = Drawing(columns * width + _GAP, rows * height + _GAP)
    for number, (name, image) in enumerate(shown):
        x, y = _GAP + number % columns * width, _GAP + number // columns * height
        try:
            pixels = _small(Path(image))
        except UpholsterError:  # removed or damaged since: the name alone
            pixels = None
        if pixels is not None:
            top, left = (_CELL - pixels.shape[0]) // 2, (_CELL - pixels.shape[1]) // 2
            sheet.paste(x + left, y + top, pixels)
        words = name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
        sheet.text(x + _CELL // 2, y + _CELL + 18, words, size=13)
    with outputs([path]) as written:
        write_image(written.path(path), sheet.pixels())
    return len(shown)


def _small(image: Path) -> PixelArray:
    """Return an image as (h, w, 3) uint8 that fits a cell."""
    pixels = read_image(image, notes=[])
    share = _CELL / max(pixels.shape[:2])
    height, width = (max(1, round(share * side)) for side in pixels.shape[:2])
    small = from_linear(to_linear(resize_image(pixels, height=height, width=width)), np.uint8)
    return small[..., :1].repeat(3, axis=2) if small.shape[2] < 3 else small[..., :3]
