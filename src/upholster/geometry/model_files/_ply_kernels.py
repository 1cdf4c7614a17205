"""Walking over rows of varying length."""

from typing import Any

from numpy.typing import NDArray

from upholster.base.types import int64
from upholster.runtime.jit import kernel

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
        (properties, 2): bytes of a list's count (0 for no list), and of an item.
    big_endian
        Byte order of the counts.
    starts, lengths
        (rows, properties), filled with the first byte of each property's items, and their number.

    Returns
    -------
    int
        The position after the rows; -1 if the data end early.
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
    """Do the same as `walk_bytes` for numbers that were text, all of size 1.

    Parameters
    ----------
    values
        (n,) float64.
    rows
        (rows + 1,) the position at which each row begins. Extra numbers in a row are skipped.
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
