"""What the kernels of method "quilt" know of blocks, and small steps that they share."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline

__all__ = [
    "BLOCK_COLUMNS",
    "EITHER",
    "LAID",
    "PHASE",
    "REFINED",
    "SOURCE_COLUMN",
    "SOURCE_ROW",
    "SYMMETRY",
    "ChoiceScratch",
    "CutScratch",
    "FramePixels",
    "LayNumbers",
    "LayWeights",
    "MatchImage",
    "Span",
    "splat_tent",
    "squared_difference",
]

# Columns of a block's record: the pixel that its centre reads, symmetry, and whether it was laid (1), laid on
# nothing (2), or not needed (0). Last the phases that the surface wants at the centre, of two waves at most,
# in 1/65536 turn.
SOURCE_ROW, SOURCE_COLUMN, SYMMETRY, LAID, PHASE = range(5)
BLOCK_COLUMNS = PHASE + 2

EITHER = 128
"""Added to a step's zone near its border: blocks of another zone may show there."""

_FEW = 4096
"""Candidates that are searched at a time: their costs stay in the fastest memory."""

REFINED = 4
"""How many of the best candidates are looked round."""


class MatchImage(NamedTuple):
    """The exemplar in its matching form, and its boxes' means, see `mean_boxes`.

    A pixel of `image` (H · W) is a number of four channels, 8 bits each: see `squared_difference`. `phases`
    (n, H · W) are its waves' phases, n = 0 where none are looked at; and `shown` (8, n) tells for each
    symmetry which wave is seen in a wave's place: k + 1 for wave k, -k - 1 for its opposite, 0 for none; of
    several zones those of one below the other.
    `allowed` (H · W) is not 0 where a block may have its source, but the number of the zone that lies there,
    and `places` are these pixels; (0,): everywhere. `guides` (K, H · W) is what each pixel is by each of the
    guides, and `costs` (K, 256) what a pixel pays that is off by so much.
    """

    image: NDArray[np.int32]
    plane: NDArray[np.float32]
    phases: NDArray[np.int16]
    shown: NDArray[np.int8]
    allowed: NDArray[np.uint8]
    places: NDArray[np.int64]
    guides: NDArray[np.uint8]
    costs: NDArray[np.int32]


class LayNumbers(NamedTuple):
    """Numbers of the sample and of blocks.

    `height`, `width` are the exemplar's on `level`; `step` pixels lie between two candidates, of which
    `shortlist` are judged, and `usage_step` between two points at which usage is counted. Blocks may have
    symmetry n where bit n of `symmetries` is 1. A block's frame is `size` × `size` pixels, its mask's cells
    are `cell` wide.
    """

    height: int
    width: int
    level: int
    step: int
    shortlist: int
    usage_step: int
    symmetries: int
    size: int
    cell: int


class LayWeights(NamedTuple):
    """Evenness and variety, each times the exemplar's variance, and how much worse than the best may do.

    `phase` is what a sample pays for a unit of `misfit`; `used` the part of the exemplar that is used.
    """

    evenness: float
    variety: float
    tolerance: float
    phase: float
    used: float


class Span(NamedTuple):
    """Which pixels a block's centre may read, first and last, and how far from it its texels then fall."""

    first_y: int
    last_y: int
    first_x: int
    last_x: int
    low_y: int
    high_y: int
    low_x: int
    high_x: int


class FramePixels(NamedTuple):
    """Scratch: the pixels of a block's frame.

    `marks` tells what there is at each, see `_frame_kernels`, and `old` what is laid; `ys`, `xs` tell where
    pixels read, seen from the source. `wanted` (K, size, size) is what guides ask for, 0 where they ask
    nothing, and `off` what is laid pays for that; (0, 0): there are no guides. `zones` (size, size) is which
    zone shall be there, see `upholster.methods.quilt.guides.Zones`; (0, 0): there are none. `steps` (size,
    size) is which step of the canvases lies there, −1 for none; (0, 0): nothing is asked.
    """

    marks: NDArray[np.uint8]
    old: NDArray[np.int32]
    ys: NDArray[np.int32]
    xs: NDArray[np.int32]
    wanted: NDArray[np.uint8]
    off: NDArray[np.int32]
    zones: NDArray[np.uint8]
    steps: NDArray[np.int64]

    @classmethod
    def of(cls, size: int, guides: int = 0, *, zones: bool = False) -> "FramePixels":
        """Return scratch for a frame, with so many guides."""
        shape = (size, size)
        return cls(
            np.empty(shape, np.uint8),
            np.empty(shape, np.int32),
            np.empty(shape, np.int32),
            np.empty(shape, np.int32),
            np.zeros((guides, size, size), np.uint8),
            np.zeros(shape if guides else (0, 0), np.int32),
            np.zeros(shape if zones else (0, 0), np.uint8),
            np.zeros(shape if guides or zones else (0, 0), np.int64),
        )


class ChoiceScratch(NamedTuple):
    """Scratch: what a source is chosen by, and candidates.

    `features` (n, 2) are boxes of what is laid, rows and columns from a candidate, and `means` their means.
    `offsets` and `values` are pixels from a candidate and what should be there, in the order in which they
    are compared; `listed` (2, n) are the same in that in which they were found. `penalties` has the shape of
    usage for one symmetry. `wanted` (2, 3) tells for each wave which of the exemplar's shall have which
    phase: its number (-1: none), 1 or -1 for its opposite, the phase. `zone` (1,) is the zone that the source
    lies in, 0 for any. `kept` are candidates as row · width +
    column, `judged` what they cost. `heap`, `costs`, `line` and `misfits` are the search's.
    """

    features: NDArray[np.int64]
    means: NDArray[np.float32]
    offsets: NDArray[np.int32]
    values: NDArray[np.int32]
    listed: NDArray[np.int32]
    penalties: NDArray[np.float64]
    wanted: NDArray[np.int64]
    zone: NDArray[np.int64]
    kept: NDArray[np.int64]
    judged: NDArray[np.int64]
    heap: NDArray[np.float32]
    costs: NDArray[np.float32]
    line: NDArray[np.float32]
    misfits: NDArray[np.int32]

    @classmethod
    def of(cls, numbers: LayNumbers, usage: NDArray[np.float64]) -> "ChoiceScratch":
        """Return scratch for frames of that size."""
        size, reach = numbers.size, numbers.step // 2
        boxes, pixels = (size // 4 + 1) ** 2, size * size
        columns = (numbers.width + numbers.step - 1) // numbers.step
        most = numbers.shortlist + REFINED * ((2 * reach + 1) ** 2 - 1)
        return cls(
            np.empty((boxes, 2), np.int64),
            np.empty(boxes, np.float32),
            np.empty(pixels, np.int32),
            np.empty(pixels, np.int32),
            np.empty((2, pixels), np.int32),
            np.empty((usage.shape[0] // numbers.symmetries.bit_count(), usage.shape[1])),
            np.zeros((2, 3), np.int64),
            np.zeros(1, np.int64),
            np.empty(most, np.int64),
            np.empty(most, np.int64),
            np.empty(most, np.float32),
            np.zeros(columns * max(1, _FEW // columns), np.float32),
            np.empty(columns, np.float32),
            np.empty(columns, np.int32),
        )


class CutScratch(NamedTuple):
    """Scratch by the cells of a block: `marks`, `missing`, `barred` see `_label_seeds`, the rest `cut_grid`.

    `balance` is by how much a cell had rather be new, as guides ask. Only `differences` has the texels of a
    row.
    """

    differences: NDArray[np.int32]
    errors: NDArray[np.int64]
    marks: NDArray[np.int32]
    missing: NDArray[np.int32]
    barred: NDArray[np.int32]
    balance: NDArray[np.int64]
    seeds: NDArray[np.int8]
    residual: NDArray[np.int64]
    work: NDArray[np.int32]

    @classmethod
    def of(cls, numbers: LayNumbers) -> "CutScratch":
        """Return scratch for frames of that size."""
        cells = (numbers.size // numbers.cell) ** 2
        return cls(
            np.empty(numbers.size, np.int32),
            np.empty(cells, np.int64),
            np.empty(cells, np.int32),
            np.empty(cells, np.int32),
            np.empty(cells, np.int32),
            np.empty(cells, np.int64),
            np.empty(cells, np.int8),
            np.empty((4, cells), np.int64),
            np.empty((4, cells), np.int32),
        )


@inline
def squared_difference(one: np.int32, other: np.int32) -> np.int32:
    """Return the sum of the squared differences of two pixels' channels.

    All in 32 bits, so that compiled code takes several pixels at a time.
    """
    low = np.int32(255)
    a = np.int32(np.int32(one & low) - np.int32(other & low))
    b = np.int32(np.int32((one >> np.int32(8)) & low) - np.int32((other >> np.int32(8)) & low))
    c = np.int32(np.int32((one >> np.int32(16)) & low) - np.int32((other >> np.int32(16)) & low))
    d = np.int32(np.int32((one >> np.int32(24)) & low) - np.int32((other >> np.int32(24)) & low))
    return np.int32(np.int32(np.int32(a * a) + np.int32(b * b)) + np.int32(np.int32(c * c) + np.int32(d * d)))


@inline
def splat_tent(
    lattice: NDArray[np.float64], step: int, row: int, column: int, height: int, width: int, by: float
) -> None:
    """Add to each point of a lattice how much of a block there a block at (row, column) covers."""
    i0, i1 = max(0, (row - height) // step + 1), min(lattice.shape[0], (row + height) // step + 1)
    j0, j1 = max(0, (column - width) // step + 1), min(lattice.shape[1], (column + width) // step + 1)
    for i in range(i0, i1):
        y = 1.0 - abs(i * step - row) / height
        for j in range(j0, j1):
            x = 1.0 - abs(j * step - column) / width
            if x > 0.0 and y > 0.0:
                lattice[i, j] += by * (x * y)
