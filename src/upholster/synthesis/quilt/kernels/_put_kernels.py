"""Pieces that the user puts, as blocks: each has its own size and rotation, and is laid before all others."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, int64
from upholster.runtime.jit import inline, kernel
from upholster.synthesis.quilt.kernels._block_kernels import LayNumbers
from upholster.synthesis.quilt.kernels._frame_kernels import write_frame
from upholster.synthesis.quilt.kernels._lay_kernels import BlockArrays, Ground, LayScratch, find_block
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays, field_at, turned

__all__ = ["put_block"]


@inline
def _times(s: FloatArray, y: float, x: float) -> tuple[float, float]:
    return s[0] * y + s[1] * x, s[2] * y + s[3] * x


@inline
def _turn_fit(field: FieldArrays, s: FloatArray, fit: FloatArray) -> None:
    # A sheet that reads ½(C + M)(q − c) must read S times that about its centre. So C becomes
    # S(C + M(c)) − M(c).
    m = turned(field_at(field, int64(fit[1]), fit[2], fit[3]), fit[10])
    fit[4], fit[5] = _times(s, fit[4], fit[5])
    a, c = _times(s, fit[6] + m[0], fit[8] + m[2])
    b, d = _times(s, fit[7] + m[1], fit[9] + m[3])
    fit[6], fit[7], fit[8], fit[9] = a - m[0], b - m[1], c - m[2], d - m[3]


@kernel
def put_block(
    ground: Ground,
    numbers: LayNumbers,
    blocks: BlockArrays,
    n: int,
    turn: FloatArray,
    half: float,
    mask: NDArray[np.uint8],
    fits: FloatArray,
    scratch: LayScratch,
) -> Any:
    """Lay block n with its own size and rotation; return its number of sheets.

    `turn` (4,) is the matrix S, row by row, from the frame pixels of other blocks to those of the piece.
    `half` is the distance that the block covers from its centre, in frame pixels of other blocks; `numbers`
    and `mask` are those of the piece. `fits` is as in `lay_blocks`.
    """
    count, pieces = find_block(ground, half, blocks, n, fits, scratch)
    maps = scratch.found.maps
    for k in range(count):
        for corner in range(3):
            maps[k, corner, 0], maps[k, corner, 1] = _times(turn, maps[k, corner, 0], maps[k, corner, 1])
    for k in range(pieces):
        _turn_fit(ground.field, turn, fits[k])
    write_frame(ground.canvases, numbers, n, blocks.records[n], mask, scratch.found, int64(count))
    return int64(pieces)
