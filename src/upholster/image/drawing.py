"""Text and lines on pictures, drawn by OpenImageIO with its own fonts."""

from itertools import pairwise

import numpy as np
from OpenImageIO import FLOAT, ROI, ImageBuf, ImageBufAlgo, ImageSpec

from upholster.base.types import PixelArray

__all__ = ["Drawing"]

Color = tuple[float, float, float]


class Drawing:
    """A picture to draw on: sRGB-coded floats, initially white.

    Parameters
    ----------
    width, height
        Size in pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._buffer = ImageBuf(ImageSpec(width, height, 3, FLOAT))
        ImageBufAlgo.fill(self._buffer, (1.0, 1.0, 1.0))

    def paste(self, x: int, y: int, pixels: PixelArray) -> None:
        """Put uint8 RGB pixels (h, w, 3) with their top left corner at (x, y)."""
        height, width = pixels.shape[:2]
        self._buffer.set_pixels(ROI(x, x + width, y, y + height), pixels.astype(np.float32) / 255)

    def text(self, x: int, y: int, words: str, *, size: int = 16, color: Color = (0.1, 0.1, 0.1)) -> None:
        """Write centred words with their baseline at y."""
        ImageBufAlgo.render_text(self._buffer, x, y, words, size, "DroidSans", color, "center", "baseline")

    def lines(
        self, points: list[tuple[float, float]], *, color: Color = (0.1, 0.1, 0.1), width: int = 1
    ) -> None:
        """Draw a line through the points, `width` pixels wide."""
        for (x0, y0), (x1, y1) in pairwise(points):
            for shift in range(width):
                offset = shift - width // 2
                across = abs(x1 - x0) < abs(y1 - y0)
                dx, dy = (offset, 0) if across else (0, offset)
                ImageBufAlgo.render_line(
                    self._buffer, round(x0) + dx, round(y0) + dy, round(x1) + dx, round(y1) + dy, color
                )

    def pixels(self) -> PixelArray:
        """Return the picture: (height, width, 3) uint8."""
        drawn = np.asarray(self._buffer.get_pixels(FLOAT), np.float32)
        return np.asarray(np.rint(np.clip(drawn, 0, 1) * 255), np.uint8)
