"""Blocks of a sample with a mask: their allowed places and sides, and the levels with room for them."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.image.masks import Used, largest_square, squares
from upholster.runtime.stages import stage

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
"""Pixels around a block's frame that must be used: cells extend beyond it, and painting mixes neighbours."""

_STEP = 4
"""Maximum distance of candidates in pixels: a square of this size has one."""

_ROUND = 2 * _MARGIN + _STEP
"""A square of used pixels must be this much larger than a frame to be sure to contain a place for it."""

_LEAST = 8
"""Minimum side of a block in pixels."""

LEAST_ROOM = _LEAST + _ROUND
"""Minimum side, in pixels, of a square of used pixels that is sure to have a place for the smallest block."""

_FEW = 0.1
"""A mask that shows a smaller share of the photo may be inverted."""

_ENOUGH = 4
"""At least this fraction, 1/4, of the used pixels are places for a block, as in a square two blocks wide."""


def check_used(used: Used | None, method: str) -> None:
    """Raise InputError if a method does not support masks, or if a mask leaves no room for a block."""
    if used is None:
        return
    if method != "quilt":
        raise InputError(f"use is given with method {method!r}; allowed: with method 'quilt'")
    found = _largest(used)
    if found < LEAST_ROOM:
        raise InputError(
            f"the largest square that the sample's mask leaves is {found}x{found} pixels; "
            f"allowed: {LEAST_ROOM}x{LEAST_ROOM} or more{_in_doubt(used)}"
        )


def check_level(used: Used | None, level: int) -> None:
    """Raise InputError if a mask leaves no room for a block where texels are as large as a level's pixels."""
    if used is None:
        return
    found = _largest(used_level(used, level))
    if found < LEAST_ROOM:
        whole, least = _largest(used), LEAST_ROOM
        raise InputError(
            f"the largest square that the sample's mask leaves is {whole}x{whole} pixels, here "
            f"{found}x{found} texels; allowed: {least}x{least} or more; use more texels or a larger sample"
            f"{_in_doubt(used)}"
        )


def _in_doubt(used: Used) -> str:
    """Return a question, for an error, if the mask shows so little that black and white may be exchanged."""
    share = np.count_nonzero(used) / used.size
    if share >= _FEW:
        return ""
    return f" ({100 * share:.2g} % of the photo is white in the mask; is it inverted?)"


def level_with_room(used: Used, level: int, most: int) -> tuple[int, int]:
    """Return a level and its largest frame, at most `most`; without room for a block, the next finer level.

    A frame of this size is sure to have an allowed candidate.
    """
    found = _largest(used_level(used, level))
    while level > 0 and found < LEAST_ROOM:
        level -= 1
        found = _largest(used_level(used, level))
    return level, min(most, found - _ROUND)


def largest_block(used: Used) -> int:
    """Return the largest side of a block, in pixels, that a user may request with a mask."""
    found = _largest(used)
    return max(_LEAST, min(3 * found // 4, found - _ROUND))


def usable_side(side: int, used: Used | None) -> int:
    """Return a block's side, or the largest smaller side for which a mask leaves enough places.

    Parameters
    ----------
    side
        The side in pixels that suits the sample and its surface: a multiple of 4.
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
    """Return the used pixels of a pyramid's level: those whose filter reads only used pixels.

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
    """Return a mask (H · W) of places where a frame and its margin cover only used pixels, however turned.

    Parameters
    ----------
    used
        (H, W) the used pixels of a level.
    size
        Side of the frame in pixels, even. The frame must be inside the level. Its margin may extend beyond,
        because reading mirrors the level there.
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
