"""The terms that blocks are compared by: LLn and HHn coefficients (paper, sections 4.2 and 4.3).

Matching works in fixed point: samples become a *working form* of 10 bits, canvases hold it with 6 fractional
bits, and coefficients are integer sums, so that the same seed gives the same quilt on any machine. A
coefficient of an 8×8 tile (three levels) is the sum of its 64 samples, signed for HH: the orthonormal one
times 8.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray, PixelArray
from upholster.synthesis.paper._match_kernels import CandidateNumbers, tile_table
from upholster.synthesis.working_form import working_form

__all__ = ["Candidates"]


@dataclass(frozen=True)
class Candidates:
    """Every position on the LLn grid at which a block is inside the exemplar.

    Attributes
    ----------
    working
        (H, W · C) uint16: the exemplar in working form, flattened.
    channels
        Number of channels.
    tile
        2^n: side in pixels of the tile of one LLn coefficient.
    table
        (2 · C, rows · columns) int32: LLn, then HHn, of each channel, for every tile of the exemplar.
    grid
        (rows, columns) of tiles.
    block
        Side of a block in pixels, a multiple of `tile`.
    """

    working: NDArray[np.uint16]
    channels: int
    tile: int
    table: NDArray[np.int32]
    grid: tuple[int, int]
    block: int

    @classmethod
    def of(cls, exemplar: PixelArray, *, block: int, levels: int) -> "Candidates":
        """Transform an exemplar of at least block × block pixels; pixels beyond full tiles are left out."""
        height, width, channels = exemplar.shape
        working = working_form(exemplar).reshape(height, -1)
        tile = 2**levels
        grid = height // tile, width // tile
        table = np.empty((2 * channels, grid[0] * grid[1]), np.int32)
        tile_table(working, channels, tile, grid[1], table)
        return cls(working, channels, tile, table, grid, block)

    @property
    def numbers(self) -> CandidateNumbers:
        """The candidates' numbers for kernels."""
        return CandidateNumbers(self.channels, self.tile, self.grid[1], *self.shape)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of candidates."""
        tiles = self.block // self.tile
        return self.grid[0] - tiles + 1, self.grid[1] - tiles + 1

    @property
    def count(self) -> int:
        """Number of candidates."""
        return self.shape[0] * self.shape[1]

    def tile_of(self, number: int) -> int:
        """Return the first tile, as a number in the grid, of candidate `number`, both row by row."""
        row, column = divmod(number, self.shape[1])
        return row * self.grid[1] + column

    def pixels(self, tiles: IntArray) -> NDArray[np.int64]:
        """Return the first pixel (row, column) of candidates given by their first tiles: (…) to (…, 2)."""
        return np.stack(np.divmod(tiles.astype(np.int64), self.grid[1]), axis=-1) * self.tile
