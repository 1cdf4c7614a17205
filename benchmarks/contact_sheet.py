"""Contact sheets: pictures side by side, each with a caption."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from upholster.base.types import PixelArray
from upholster.covering.measure.samples import coded
from upholster.image.files.write import write_image

__all__ = ["Tile", "write_sheet"]

MARGIN = 12
LINE = 20

Tile = tuple[PixelArray, Sequence[str]]
"""A picture (h, w, C) and the lines under it."""


def write_sheet(path: Path, tiles: Sequence[Tile], *, columns: int = 3) -> None:
    """Write pictures in rows, each at its own size with its lines below, as PNG."""
    cells = [(_rgb(picture), lines) for picture, lines in tiles]
    width = max(picture.shape[1] for picture, _ in cells)
    rows = [cells[n : n + columns] for n in range(0, len(cells), columns)]
    heights = [
        max(picture.shape[0] for picture, _ in row) + LINE * max(len(lines) for _, lines in row) + MARGIN
        for row in rows
    ]
    across = min(columns, len(cells)) * (width + MARGIN) + MARGIN
    sheet = Image.new("RGB", (across, sum(heights) + MARGIN), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    top = MARGIN
    for row, height in zip(rows, heights, strict=True):
        left = MARGIN
        for picture, lines in row:
            sheet.paste(Image.fromarray(picture), (left, top))
            for n, line in enumerate(lines):
                place = (left, top + picture.shape[0] + 2 + LINE * n)
                draw.text(place, line, fill="black", font=font)
            left += width + MARGIN
        top += height
    write_image(path, np.asarray(sheet))


def _rgb(picture: PixelArray) -> PixelArray:
    values = np.rint(255 * np.clip(coded(picture), 0, 1)).astype(np.uint8)
    return (
        np.repeat(values[:, :, :1], 3, axis=2)
        if values.shape[2] < 3
        else np.ascontiguousarray(values[:, :, :3])
    )
