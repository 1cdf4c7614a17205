"""Pieces of the sample that the user puts at chosen places, and their form as blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.image.masks import Used
from upholster.quilt.chart import Chart
from upholster.synthesis.quilt.kernels._block_kernels import CourseRule, LayNumbers

__all__ = ["PieceFrame", "PutPiece", "piece_frame"]

_CELL = 2
"""Side in pixels of the cells that approximate a piece's outline."""


@dataclass(frozen=True, eq=False, slots=True)
class PutPiece:
    """A piece of the sample at a place that the user chose.

    Attributes
    ----------
    step
        Chart, row and column of the place.
    rectangle
        Row, column, height and width of the piece in the sample, in pixels.
    size
        Factor by which the piece is enlarged, relative to the sample.
    degrees
        Angle of rotation, clockwise seen from outside.
    used
        (height, width) mask of the piece's pixels that show; None: all.
    """

    step: tuple[int, int, int]
    rectangle: tuple[int, int, int, int]
    size: float = 1.0
    degrees: float = 0.0
    used: Used | None = None

    def on_charts(self, before: Sequence[Chart], after: Sequence[Chart]) -> "PutPiece":
        """Return the same piece on charts of the same faces with other steps."""
        chart, row, column = self.step
        old, new = before[chart], after[chart]
        at = (int((row + 0.5) * new.height / old.height), int((column + 0.5) * new.width / old.width))
        return replace(self, step=(chart, *at))

    def turn(self) -> FloatArray:
        """Return the matrix S (4,), row by row, from frame pixels of other blocks to those of the piece."""
        angle = np.radians(self.degrees)
        c, s = np.cos(angle) / self.size, np.sin(angle) / self.size
        return np.array([c, -s, s, c])


@dataclass(frozen=True, eq=False, slots=True)
class PieceFrame:
    """A piece as a block.

    Attributes
    ----------
    numbers
        The numbers of blocks, with the size and the cell of the piece's frame.
    source
        Row and column of the pixel that its centre reads.
    mask
        Mask of the frame's cells that show.
    half
        Distance from its centre to its corners and a little more, in the frame pixels of other blocks.
    """

    numbers: LayNumbers
    source: tuple[int, int]
    mask: NDArray[np.uint8]
    half: float


def piece_frame(piece: PutPiece, numbers: LayNumbers) -> PieceFrame:
    """Return a piece as a block of the level in `numbers`."""
    level = numbers.level
    top, left, height, width = (value / 2**level for value in piece.rectangle)
    size = 2 * _CELL * int(np.ceil(max(height, width, 2 * _CELL) / (2 * _CELL)))
    middle = int(top + height / 2), int(left + width / 2)
    source = middle[0] + numbers.fringe, middle[1] + numbers.fringe
    # The centres of the cells: relative to the frame's centre, then to the piece's first pixel.
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
        numbers._replace(size=size, cell=_CELL, course=CourseRule()),
        source,
        shows.astype(np.uint8).reshape(-1),
        half,
    )
