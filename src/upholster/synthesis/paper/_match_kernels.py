"""Coefficients of tiles, and the search for the block that matches them best."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline, kernel

__all__ = ["CandidateNumbers", "Features", "add_tile", "best_candidate", "tile_coefficients", "tile_table"]

FRACTION_BITS = 6
"""Fractional bits of canvases, and therefore of their coefficients."""


class CandidateNumbers(NamedTuple):
    """The exemplar's candidates: its channels, the tile's side, tiles in a row, rows and columns of them."""

    channels: int
    tile: int
    grid_columns: int
    rows: int
    columns: int


class Features(NamedTuple):
    """Scratch: a feature compares `values[f]` with `table[bands[f], candidate + offsets[f]]`."""

    bands: NDArray[np.int32]
    offsets: NDArray[np.int32]
    values: NDArray[np.int32]
    costs: NDArray[np.int64]


@inline
def tile_coefficients(
    image: NDArray[np.uint16], row: int, x: int, channels: int, tile: int
) -> tuple[int, int]:
    """Return LLn and HHn (times 2^n) of one channel's tile whose first sample is `image[row, x]`."""
    half = tile // 2
    even: Any = 0
    odd: Any = 0
    for i in range(tile):
        line = image[row + i]
        left: Any = 0
        right: Any = 0
        for j in range(half):
            left += np.int64(line[x + j * channels])
            right += np.int64(line[x + (j + half) * channels])
        if i < half:
            even += left
            odd += right
        else:
            even += right
            odd += left
    return even + odd, even - odd


@kernel
def tile_table(
    image: NDArray[np.uint16], channels: int, tile: int, columns: int, table: NDArray[np.int32]
) -> None:
    """Fill `table` (2 · channels, tiles) with LLn and HHn of each tile of `image` (H, W · channels)."""
    for n in range(table.shape[1]):
        row, column = n // columns, n % columns
        for k in range(channels):
            low, high = tile_coefficients(image, row * tile, column * tile * channels + k, channels, tile)
            table[k, n] = low
            table[channels + k, n] = high


@inline
def _rounded(value: int) -> np.int32:
    return np.int32((value + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS)


@inline
def add_tile(
    features: Features,
    count: int,
    numbers: CandidateNumbers,
    canvas: NDArray[np.uint16],
    row: int,
    column: int,
    offset: int,
) -> int:
    """Add the LLn and HHn of the canvas's tile at (row, column) as features; return the number of features.

    `offset` is the position of the tile to compare with, relative to a candidate's first tile.
    """
    for k in range(numbers.channels):
        low, high = tile_coefficients(
            canvas, row, column * numbers.channels + k, numbers.channels, numbers.tile
        )
        features.bands[count], features.bands[count + 1] = k, numbers.channels + k
        features.offsets[count] = features.offsets[count + 1] = offset
        features.values[count], features.values[count + 1] = _rounded(low), _rounded(high)
        count += 2
    return count


@kernel
def best_candidate(
    table: NDArray[np.int32], numbers: CandidateNumbers, features: Features, count: int
) -> int:
    """Return the candidate with the least sum of squared differences; the lowest index among equals.

    The first `count` features are compared. A candidate is its first tile's index in the exemplar's grid.
    Candidates are processed in one run over the grid. The run includes the few that would wrap around its
    right side, which are never chosen, because long runs suit vector units.
    """
    bands, offsets, values, costs = features.bands, features.offsets, features.values, features.costs
    grid_columns, candidate_rows, candidate_columns = numbers.grid_columns, numbers.rows, numbers.columns
    best, least = 0, np.int64(2**62)
    total = (candidate_rows - 1) * grid_columns + candidate_columns
    step = costs.shape[0]
    for start in range(0, total, step):
        size = min(step, total - start)
        part = costs[:size]
        for n in range(size):
            part[n] = 0
        f = 0
        while f + 4 <= count:  # four features per pass: a quarter of the loads and stores of the sums
            a, b = table[bands[f], start + offsets[f] :], table[bands[f + 1], start + offsets[f + 1] :]
            c, d = (
                table[bands[f + 2], start + offsets[f + 2] :],
                table[bands[f + 3], start + offsets[f + 3] :],
            )
            va, vb, vc, vd = values[f], values[f + 1], values[f + 2], values[f + 3]
            for n in range(size):
                p, q = np.int64(np.int32(a[n] - va)), np.int64(np.int32(b[n] - vb))
                r, s = np.int64(np.int32(c[n] - vc)), np.int64(np.int32(d[n] - vd))
                part[n] += (p * p + q * q) + (r * r + s * s)
            f += 4
        while f < count:
            a = table[bands[f], start + offsets[f] :]
            va = values[f]
            for n in range(size):
                p = np.int64(np.int32(a[n] - va))
                part[n] += p * p
            f += 1
        for n in range(size):
            if part[n] < least and (start + n) % grid_columns < candidate_columns:
                least = part[n]
                best = start + n
    return best
