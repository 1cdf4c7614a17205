"""Walking over rows of different lengths."""

from typing import Any

from numpy.typing import NDArray

from upholster.jit import kernel
from upholster.types import int64

__all__ = ["walk_bytes", "walk_numbers"]


@kernel
def walk_bytes(
    data: NDArray[Any],
    layout: NDArray[int64],
    big_endian: bool,
    starts: NDArray[int64],
    lengths: NDArray[int64],
) -> int64:
    """Find the properties of an element's rows in bytes.

    Parameters
    ----------
    data
        (n,) uint8.
    layout
        (properties, 2): bytes of a list's count (0: no list), and of an item.
    big_endian
        How counts are written.
    starts, lengths
        (rows, properties), filled: the first byte of each property's items, and how many they are.

    Returns
    -------
    int
        Where the rows end; -1 if the data do first.
    """
    at = 0
    for row in range(len(starts)):
        for column in range(len(layout)):
            count = 1
            size = layout[column, 0]
            if size > 0:
                if at + size > len(data):
                    return -1
                count = 0
                for k in range(size):
                    count = 256 * count + data[at + (k if big_endian else size - 1 - k)]
                at += size
            starts[row, column] = at
            lengths[row, column] = count
            if count > len(data):
                return -1
            at += count * layout[column, 1]
            if at > len(data):
                return -1
    return at


@kernel
def walk_numbers(
    values: NDArray[Any],
    rows: NDArray[int64],
    layout: NDArray[int64],
    starts: NDArray[int64],
    lengths: NDArray[int64],
) -> bool:
    """Do what `walk_bytes` does over numbers that were text, all of size 1.

    Parameters
    ----------
    values
        (n,) float64.
    rows
        (rows + 1,) where each row begins. What is left over in a row is passed by.
    layout, starts, lengths
        As for `walk_bytes`.

    Returns
    -------
    bool
        Whether no row is too short.
    """
    for row in range(len(starts)):
        at, end = rows[row], rows[row + 1]
        for column in range(len(layout)):
            count = 1
            if layout[column, 0] > 0:
                if at >= end or values[at] < 0 or values[at] > end - at:
                    return False
                count = int(values[at])
                at += 1
            starts[row, column] = at
            lengths[row, column] = count
            at += count
            if at > end:
                return False
    return True
