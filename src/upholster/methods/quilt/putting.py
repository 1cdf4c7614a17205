"""Pieces of the sample that are put by hand: where they lie, and as what blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.image.masks import Used
from upholster.methods.quilt._block_kernels import LayNumbers
from upholster.quilt.chart import Chart
from upholster.types import FloatArray

__all__ = ["PieceFrame", "PutPiece", "piece_frame"]

_CELL = 2
"""Pixels a side of the cells in which a piece has an outline."""

MOST_PIECE = 1024
"""Pixels of a piece's longer side, on the level that is laid."""


@dataclass(frozen=True, eq=False, slots=True)
class PutPiece:
    """A piece of the sample that lies at a place.

    Attributes
    ----------
    step
        Chart, row and column of the place.
    rectangle
        Row, column, height and width of the piece in the sample, in pixels.
    size
        How many times as large as the sample it lies there.
    degrees
        By which it is turned, clockwise seen from outside.
    used
        (height, width) which of its pixels show; None: all.
    """

    step: tuple[int, int, int]
    rectangle: tuple[int, int, int, int]
    size: float = 1.0
    degrees: float = 0.0
    used: Used | None = None

    def on_charts(self, before: Sequence[Chart], after: Sequence[Chart]) -> "PutPiece":
        """Return the same on charts of other steps, of the same faces."""
        chart, row, column = self.step
        old, new = before[chart], after[chart]
        at = (int((row + 0.5) * new.height / old.height), int((column + 0.5) * new.width / old.width))
        return replace(self, step=(chart, *at))

    def turn(self) -> FloatArray:
        """Return S (4,): from frame pixels as any block has them to those of the piece, rows first."""
        angle = np.radians(self.degrees)
        c, s = np.cos(angle) / self.size, np.sin(angle) / self.size
        return np.array([c, -s, s, c])


@dataclass(frozen=True, eq=False, slots=True)
class PieceFrame:
    """A piece as a block.

    Attributes
    ----------
    numbers
        Sizes, with the piece's frame.
    source
        Row and column of the pixel that its centre reads.
    mask
        Which of the frame's cells show.
    half
        How far it reaches from its centre, in frame pixels as any block has them.
    """

    numbers: LayNumbers
    source: tuple[int, int]
    mask: NDArray[np.uint8]
    half: float


def piece_frame(piece: PutPiece, numbers: LayNumbers) -> PieceFrame:
    """Return a piece as a block of the level that `numbers` tells of."""
    level = numbers.level
    top, left, height, width = (value / 2**level for value in piece.rectangle)
    size = 2 * _CELL * int(np.ceil(max(height, width, 2 * _CELL) / (2 * _CELL)))
    middle = int(top + height / 2), int(left + width / 2)
    # The middles of the cells, from the piece's first pixel on.
    at = (np.arange(size // _CELL) + 0.5) * _CELL - size / 2
    rows, columns = at + middle[0] - top, at + middle[1] - left
    inside = (rows >= 0) & (rows < height), (columns >= 0) & (columns < width)
    shows = inside[0][:, None] & inside[1]
    if piece.used is not None:
        i, j = (
            np.clip((places * 2**level).astype(np.int64), 0, count - 1)
            for places, count in zip((rows, columns), piece.used.shape, strict=True)
        )
        shows &= piece.used[i[:, None], j]
    half = piece.size * float(np.hypot(height, width)) / 2 + _CELL
    return PieceFrame(
        numbers._replace(size=size, cell=_CELL), middle, shows.astype(np.uint8).reshape(-1), half
    )
