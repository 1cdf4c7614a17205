"""What of a sample with a mask blocks may show: places, sides, and levels at which enough is left."""

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.image.masks import Used, largest_square, squares
from upholster.stages import stage

__all__ = [
    "LEAST_ROOM",
    "allowed_places",
    "check_level",
    "check_used",
    "largest_block",
    "level_with_room",
    "usable_side",
    "used_level",
]

_MARGIN = 3
"""Pixels round a block's frame that are used, too: cells end beyond it, and painting mixes neighbours."""

_STEP = 4
"""Candidates are so far apart at most: of so many each way, one is allowed."""

_ROUND = 2 * _MARGIN + _STEP
"""How much larger a square of used pixels is than a frame that is sure to have a place in it."""

_LEAST = 8
"""Pixels of a block, at least."""

LEAST_ROOM = _LEAST + _ROUND
"""Pixels of the smallest square of used ones in which the smallest block is sure to have a place."""

_ENOUGH = 4
"""At least so great a part of what is used is a place for a block: as if it were two blocks wide."""


def check_used(used: Used | None, method: str) -> None:
    """Raise InputError where a method knows nothing of masks, or a mask leaves no room for a block."""
    if used is None:
        return
    if method != "quilt":
        raise InputError(f"use is given with method {method!r}; allowed: with method 'quilt'")
    found = _largest(used)
    if found < LEAST_ROOM:
        raise InputError(
            f"the largest square that the sample's mask leaves is {found}x{found} pixels; "
            f"allowed: {LEAST_ROOM}x{LEAST_ROOM} or more"
        )


def check_level(used: Used | None, level: int) -> None:
    """Raise InputError where a mask leaves no room for a block, of texels as large as a level's pixels."""
    if used is None:
        return
    found = _largest(used_level(used, level))
    if found < LEAST_ROOM:
        whole, least = _largest(used), LEAST_ROOM
        raise InputError(
            f"the largest square that the sample's mask leaves is {whole}x{whole} pixels, here "
            f"{found}x{found} texels; allowed: {least}x{least} or more, by more texels or a larger sample"
        )


def level_with_room(used: Used, level: int, most: int) -> tuple[int, int]:
    """Return a level, or the next finer one with room for a block; and the largest frame there, to `most`.

    For such a frame one of the candidates is sure to be allowed.
    """
    found = _largest(used_level(used, level))
    while level > 0 and found < LEAST_ROOM:
        level -= 1
        found = _largest(used_level(used, level))
    return level, min(most, found - _ROUND)


def largest_block(used: Used) -> int:
    """Return the largest side of a block, in pixels, that a mask lets anyone ask for."""
    found = _largest(used)
    return max(_LEAST, min(3 * found // 4, found - _ROUND))


def usable_side(side: int, used: Used | None) -> int:
    """Return a block's side, or the largest smaller one that leaves enough places to choose from.

    Parameters
    ----------
    side
        In pixels, as it suits the sample and its surface: a multiple of 4.
    used
        (H, W); None: all.

    Returns
    -------
    int
        A multiple of 4, 8 or more.
    """
    if used is None:
        return side
    least, most = _LEAST // 4, max(_LEAST, min(side, largest_block(used))) // 4
    while least < most:
        middle = (least + most + 1) // 2
        if _ENOUGH * np.count_nonzero(squares(used, 4 * middle)) >= np.count_nonzero(used):
            least = middle
        else:
            most = middle - 1
    return 4 * least


def used_level(used: Used, level: int) -> Used:
    """Return which pixels of a pyramid's level are used: those whose filter reads used pixels alone.

    See `upholster.quilt.pyramid.halved`.
    """
    for _ in range(level):
        for axis in (0, 1):
            size = used.shape[axis]
            at = 2 * np.arange((size + 1) // 2)
            parts = [np.take(used, np.clip(at + k, 0, size - 1), axis) for k in (-1, 0, 1, 2)]
            used = parts[0] & parts[1] & parts[2] & parts[3]
    return used


def allowed_places(used: Used, size: int) -> NDArray[np.uint8]:
    """Return (H · W) where a frame and its margin lie on used pixels alone, whichever way it is turned.

    Parameters
    ----------
    used
        (H, W) of a level.
    size
        Pixels of the frame's side, even. It lies inside the level; its margin may not: beyond the level, what
        is read is mirrored.
    """
    half = size // 2
    reach = half + _MARGIN
    found = squares(np.pad(used, reach, constant_values=True), 2 * reach + 1)
    out = np.zeros(used.shape, np.uint8)
    inside = slice(half, used.shape[0] - half), slice(half, used.shape[1] - half)
    out[inside] = found[inside]
    return out.reshape(-1)


@stage
def _largest(used: Used) -> int:
    return largest_square(used)
