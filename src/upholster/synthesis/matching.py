"""What blocks are compared by: LLn and HHn coefficients on their grid (paper, sections 4.2 and 4.3).

Matching works in fixed point: samples become a *working form* of 10 bits, canvases hold it with 6 fractional
bits, and coefficients are integer sums, so that the same seed gives the same quilt on any machine. A
coefficient of an 8×8 tile (three levels) is the sum of its 64 samples, signed for HH: the orthonormal one
times 8.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.synthesis._match_kernels import tile_table
from upholster.types import PixelArray

__all__ = ["Candidates", "working_form"]

WORKING_MAX = 1023


def working_form(exemplar: PixelArray) -> NDArray[np.uint16]:
    """Return the exemplar as matching sees it: (H, W, C) uint16 from 0 to 1023.

    8-bit samples times 4, 16-bit samples divided by 64; float samples from their smallest to their largest.
    """
    if exemplar.dtype == np.uint8:
        return np.left_shift(exemplar, 2, dtype=np.uint16)
    if exemplar.dtype == np.uint16:
        return np.right_shift(exemplar, 6, dtype=np.uint16)
    low, high = float(exemplar.min()), float(exemplar.max())
    scale = WORKING_MAX / (high - low) if high > low else 0.0
    return np.rint((exemplar.astype(np.float64) - low) * scale).astype(np.uint16)


@dataclass(frozen=True)
class Candidates:
    """Every place on the LLn grid where a block lies inside the exemplar.

    Attributes
    ----------
    working
        (H, W · C) uint16: the exemplar in working form, flattened.
    channels
        C.
    tile
        2^n: side of the tile that one LLn coefficient stands for, in pixels.
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
        """Transform an exemplar of at least block × block pixels; what is beyond full tiles is left out."""
        height, width, channels = exemplar.shape
        working = working_form(exemplar).reshape(height, -1)
        tile = 2**levels
        grid = height // tile, width // tile
        table = np.empty((2 * channels, grid[0] * grid[1]), np.int32)
        tile_table(working, channels, tile, grid[1], table)
        return cls(working, channels, tile, table, grid, block)

    @property
    def shape(self) -> tuple[int, int]:
        """How many candidates there are: rows, columns."""
        tiles = self.block // self.tile
        return self.grid[0] - tiles + 1, self.grid[1] - tiles + 1

    @property
    def count(self) -> int:
        """How many candidates there are."""
        return self.shape[0] * self.shape[1]


def matching_form(image: PixelArray, *, most: int = 4) -> tuple[NDArray[np.uint8], float]:
    """Return an image as the search sees it: its main colours, in whole numbers of 0 to 255.

    The samples' principal components, in order of their variance, as many as hold 99 % of it. All are scaled
    alike, so that distances stay what they were; the first spans 0 to 255. The directions are rounded, so
    that every machine finds the same numbers.

    Parameters
    ----------
    image
        (H, W, C), C any; uint8, uint16 or float32.
    most
        Components at most.

    Returns
    -------
    form : ndarray
        (H, W, K) uint8.
    variance
        Mean squared distance from the mean colour, in these units.
    """
    samples = working_form(image).reshape(-1, image.shape[2]).astype(np.int64)
    centred = samples - np.rint(samples.mean(axis=0)).astype(np.int64)
    values, directions = np.linalg.eigh((centred.T @ centred).astype(np.float64))
    order = np.argsort(values)[::-1][:most]
    share = np.cumsum(values[order]) / max(1e-9, values.sum())
    order = order[: 1 + int(np.searchsorted(share, 0.99))]
    main = directions[:, order]
    main = main * np.sign(main[np.abs(main).argmax(axis=0), np.arange(main.shape[1])])
    parts = centred @ np.rint(1024 * main).astype(np.int64)
    low, high = np.sort(parts[:, 0])[[len(parts) // 1000, -1 - len(parts) // 1000]]
    span = max(1, int(high - low))
    middle = np.zeros(len(order), np.int64)
    middle[0] = (low + high) // 2
    form = np.clip((2 * 255 * (parts - middle) + 256 * span) // (2 * span), 0, 255).astype(np.uint8)
    variance = float(form.astype(np.float64).var(axis=0).sum())
    return form.reshape(*image.shape[:2], -1), variance
