"""Text, lines and composition of pictures with Pillow; colours of maps.

Pillow's built-in font has neither Greek letters nor accents: the few that the figures need are drawn.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

__all__ = ["INK", "PAPER", "Panel", "compose", "enlarged", "heat", "save_jpeg", "text", "text_width"]

INK, PAPER = (34, 36, 40), (255, 255, 255)
MARGIN, GAP, TITLE = 22, 22, 20
MOST_BYTES = 600_000
QUALITIES = (90, 88, 85, 82, 78, 74, 70)

# Anchors of the colour map viridis (S. van der Walt, N. Smith; CC0), dark to bright.
_HEAT = np.array(
    [
        (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
        (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
    ],
    np.float64,
)  # fmt: skip


class Panel(NamedTuple):
    """One picture of a sheet, and the line below it."""

    image: Any
    title: str


def heat(values: ArrayLike) -> NDArray[np.uint8]:
    """Return the colours (..., 3) of values (...,) from 0, dark, to 1, bright."""
    place = np.clip(np.asarray(values, np.float64), 0, 1)
    anchors = np.linspace(0, 1, len(_HEAT))
    colors = [np.interp(place, anchors, _HEAT[:, channel]) for channel in range(3)]
    return np.stack(colors, axis=-1).round().astype(np.uint8)


def enlarged(pixels: NDArray[Any], factor: int) -> Any:
    """Return pixels (H, W) or (H, W, 3) as an image `factor` times as large, its pixels as squares."""
    grey = pixels.reshape(*pixels.shape[:2], -1)
    color = np.broadcast_to(grey, (*grey.shape[:2], 3))
    return Image.fromarray(np.kron(color, np.ones((factor, factor, 1), np.uint8)).astype(np.uint8))


@cache
def _font(size: int) -> Any:
    return ImageFont.load_default(size=size)


def text_width(words: str, size: int) -> float:
    """Return how wide `text` draws."""
    return sum(_advance(part, size) for part in _parts(words))


def text(
    draw: Any,
    place: tuple[float, float],
    words: str,
    *,
    size: int = TITLE,
    color: tuple[int, ...] = INK,
    align: float = 0.0,
) -> None:
    """Draw words with their middle line at `place`; `align`: 0 left, 0.5 centred, 1 right of it."""
    x, y = place[0] - align * text_width(words, size), place[1]
    for part in _parts(words):
        if part in _DRAWN:
            _DRAWN[part](draw, x, y, size, color)
        else:
            draw.text((x, y), part, font=_font(size), fill=color, anchor="lm")
        x += _advance(part, size)


def _parts(words: str) -> list[str]:
    parts = [""]
    for letter in words:
        if letter in _DRAWN or parts[-1] in _DRAWN:
            parts.append(letter)
        else:
            parts[-1] += letter
    return [part for part in parts if part]


def _advance(part: str, size: int) -> float:
    if part in ("θ", "φ"):
        return 0.62 * size
    return float(_font(size).getlength(_PLAIN.get(part, part)))


def _theta(draw: Any, x: float, y: float, size: int, color: tuple[int, ...]) -> None:
    line = max(1, round(size / 11))
    box = (x + 0.08 * size, y - 0.38 * size, x + 0.50 * size, y + 0.34 * size)
    draw.ellipse(box, outline=color, width=line)
    draw.line((box[0] + line, y - 0.02 * size, box[2] - line, y - 0.02 * size), fill=color, width=line)


def _phi(draw: Any, x: float, y: float, size: int, color: tuple[int, ...]) -> None:
    line = max(1, round(size / 11))
    draw.ellipse(
        (x + 0.03 * size, y - 0.2 * size, x + 0.55 * size, y + 0.32 * size), outline=color, width=line
    )
    draw.line((x + 0.29 * size, y - 0.42 * size, x + 0.29 * size, y + 0.52 * size), fill=color, width=line)


def _e_acute(draw: Any, x: float, y: float, size: int, color: tuple[int, ...]) -> None:
    draw.text((x, y), "e", font=_font(size), fill=color, anchor="lm")
    accent = (x + 0.24 * size, y - 0.28 * size, x + 0.38 * size, y - 0.42 * size)
    draw.line(accent, fill=color, width=max(1, round(size / 11)))


def _mu(draw: Any, x: float, y: float, size: int, color: tuple[int, ...]) -> None:
    draw.text((x, y), "u", fill=color, font=_font(size), anchor="lm")
    line = max(1, round(size / 11))
    stem = x + 0.09 * size
    draw.line((stem, y + 0.1 * size, stem, y + 0.5 * size), fill=color, width=line)


_PLAIN = {"é": "e", "µ": "u"}
_DRAWN = {"µ": _mu, "θ": _theta, "φ": _phi, "é": _e_acute}


def compose(rows: Sequence[Sequence[Panel]], *, gap: int = GAP) -> Any:
    """Lay panels out in rows on a white sheet, each row centred, each title centred below its picture."""
    below = TITLE + 16
    widths = [sum(panel.image.width for panel in row) + gap * (len(row) - 1) for row in rows]
    heights = [
        max(panel.image.height for panel in row) + (below if any(panel.title for panel in row) else 0)
        for row in rows
    ]
    width = max(widths) + 2 * MARGIN
    sheet = Image.new("RGB", (width, sum(heights) + gap * (len(rows) - 1) + 2 * MARGIN), PAPER)
    draw = ImageDraw.Draw(sheet)
    y = MARGIN
    for row, row_width, height in zip(rows, widths, heights, strict=True):
        x = (width - row_width) // 2
        for panel in row:
            free = height - panel.image.height - (below if panel.title else 0)
            sheet.paste(panel.image, (x, y + free // 2))
            middle = x + panel.image.width / 2
            text(draw, (middle, y + height - below / 2 + 2), panel.title, align=0.5)
            x += panel.image.width + gap
        y += height + gap
    return sheet


def save_jpeg(image: Any, path: Path, *, most: int = MOST_BYTES) -> int:
    """Write a JPEG file at the best quality that keeps it below so many bytes; return its bytes."""
    for quality in QUALITIES:
        image.save(path, "JPEG", quality=quality, optimize=True, progressive=True, subsampling=0)
        if path.stat().st_size < most:
            break
    return path.stat().st_size
