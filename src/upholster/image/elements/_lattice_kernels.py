"""Following a wave over a sample, in a fixed order of operations: the same on every machine."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray
from upholster.runtime.jit import kernel

__all__ = ["add_beats", "interpolate_phases", "smooth_nodes"]


@kernel
def add_beats(
    plane: NDArray[np.int64],
    step: tuple[int, int],
    cell: int,
    cosines: NDArray[np.int64],
    beats: NDArray[np.int64],
) -> None:
    """Add to `beats` (2, rows, columns) the part of a plane (H, W) that matches a wave, cell by cell.

    The wave's phase grows by `step` per row and per column, in 2^-32 of a turn; `cosines` holds one turn in
    4096 steps. The sums of plane · cos and −plane · sin are over the `cell` × `cell` pixels of each cell.
    """
    for i in range(plane.shape[0]):
        for j in range(plane.shape[1]):
            turn = (i * step[0] + j * step[1]) >> 20
            beats[0, i // cell, j // cell] += plane[i, j] * cosines[turn & 4095]
            beats[1, i // cell, j // cell] += plane[i, j] * cosines[(turn + 1024) & 4095]


@kernel
def smooth_nodes(nodes: FloatArray, taps: FloatArray, scratch: FloatArray, out: FloatArray) -> None:
    """Filter nodes (2, rows, columns) along both axes by `taps` (2·n + 1,), with 0 beyond the borders.

    `scratch` and `out` are of the nodes' shape, and zero.
    """
    rows, columns = nodes.shape[1], nodes.shape[2]
    reach = taps.shape[0] // 2
    for part in range(2):
        for i in range(rows):
            line = scratch[part, i]
            for k in range(max(-reach, -i), min(reach, rows - 1 - i) + 1):
                tap, source = taps[k + reach], nodes[part, i + k]
                for j in range(columns):
                    line[j] += tap * source[j]
            for k in range(max(-reach, 1 - columns), min(reach, columns - 1) + 1):
                first, last = max(0, -k), min(columns, columns - k)
                tap, source, target = taps[k + reach], line[first + k : last + k], out[part, i, first:last]
                for j in range(last - first):
                    target[j] += tap * source[j]


@kernel
def interpolate_phases(
    nodes: NDArray[np.int16], spacing: int, step: tuple[int, int], out: NDArray[np.int16]
) -> None:
    """Write the phases of a wave at all pixels (H, W): its steady growth plus the nodes' deviation from it.

    Node (i, j), in 2^-16 of a turn, is in the middle of its `spacing` × `spacing` pixels. Between nodes the
    deviation is bilinear; beyond the outermost it is constant. `step` is as for `add_beats`.
    """
    rows, columns = nodes.shape
    twice = 2 * spacing
    for r in range(out.shape[0]):
        # In half pixels from the first node's row.
        down = min(max(2 * r + 1 - spacing, 0), (rows - 1) * twice)
        i = min(down // twice, max(rows - 2, 0))
        below, y = min(i + 1, rows - 1), down - i * twice
        for c in range(out.shape[1]):
            right = min(max(2 * c + 1 - spacing, 0), (columns - 1) * twice)
            j = min(right // twice, max(columns - 2, 0))
            after, x = min(j + 1, columns - 1), right - j * twice
            base = np.int64(nodes[i, j])
            # Differences of phases wrap.
            along = (nodes[i, after] - base + 32768 & 65535) - 32768
            across = (nodes[below, j] - base + 32768 & 65535) - 32768
            both = across + ((nodes[below, after] - nodes[below, j] + 32768 & 65535) - 32768)
            mixed = (along * (twice - y) + (both - across) * y) * x + across * y * twice
            deviation = base + (2 * mixed + twice * twice) // (2 * twice * twice)
            out[r, c] = np.int16(((r * step[0] + c * step[1] >> 16) + deviation + 32768 & 65535) - 32768)
