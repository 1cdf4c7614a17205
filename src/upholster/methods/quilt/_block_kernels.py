"""What the kernels of method "quilt" know of a chart's blocks, and small steps that they share."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline

__all__ = [
    "BLOCK_COLUMNS",
    "COLUMN",
    "LAID",
    "LEFT",
    "PHASE",
    "REFINED",
    "ROW",
    "SOURCE_COLUMN",
    "SOURCE_ROW",
    "SYMMETRY",
    "TOP",
    "BlockTexels",
    "ChartCanvas",
    "ChoiceScratch",
    "CutScratch",
    "LayNumbers",
    "LayScratch",
    "LayWeights",
    "MatchImage",
    "Span",
    "SymmetryScratch",
    "pixel_at",
    "position_of",
    "splat_tent",
    "squared_difference",
    "whole_pixels",
]

# Columns of a block's record: centre, indices of the left and upper neighbours (-1: none), then what the
# kernel finds: source in 1/16 pixel, symmetry, and whether it was laid (1), laid on nothing (2), or not
# needed (0). Last the phases that the surface wants at the centre, of two waves at most, in 1/65536 turn.
ROW, COLUMN, LEFT, TOP, SOURCE_ROW, SOURCE_COLUMN, SYMMETRY, LAID, PHASE = range(9)
BLOCK_COLUMNS = PHASE + 2

_FEW = 4096
"""Candidates that are searched at a time: their costs stay in the fastest memory."""

REFINED = 4
"""How many of the best candidates are looked round."""


class ChartCanvas(NamedTuple):
    """A chart and what is round it, every block whole.

    `canvas` (rows, columns) holds the pixels that are laid; `covered` (rows, columns) has bit 0 where
    something is, and bit 1 where it must not change, for finished charts go on there. `symmetries` (rows,
    columns) holds the symmetry of the block that each laid texel comes from.
    """

    canvas: NDArray[np.int32]
    covered: NDArray[np.uint8]
    symmetries: NDArray[np.uint8]


class MatchImage(NamedTuple):
    """The exemplar in its matching form, and its boxes' means, see `mean_boxes`.

    A pixel of `image` (H · W) is a number of four channels, 8 bits each: see `squared_difference`. `phases`
    (n, H · W) are its waves' phases, n = 0 where none are looked at; and `shown` (8, n) tells for each
    symmetry which wave is seen in a wave's place: k + 1 for wave k, -k - 1 for its opposite, 0 for none.
    """

    image: NDArray[np.int32]
    plane: NDArray[np.float32]
    phases: NDArray[np.int16]
    shown: NDArray[np.int8]


class LayNumbers(NamedTuple):
    """Numbers of a chart and its blocks.

    `height`, `width` are the exemplar's on `level`; `step` pixels lie between two candidates, of
    which `shortlist` are judged, and `usage_step` between two points at which usage is counted. Blocks may
    have symmetry n where bit n of `symmetries` is 1. `margin` is the warp field's. Texel (0, 0) lies at
    (`origin_row`, `origin_column`) of the canvas; if `wrap` is 1, the canvas's ends meet. A block is
    `block_height` × `block_width` texels, its mask's cells `mask_cell`; `across` blocks lie side by side.
    Every `sample`-th texel is compared. Texels from `need_top` and `need_left` to before `need_bottom` and
    `need_right` are to be covered.
    """

    height: int
    width: int
    level: int
    step: int
    shortlist: int
    usage_step: int
    symmetries: int
    margin: int
    origin_row: int
    origin_column: int
    wrap: int
    block_height: int
    block_width: int
    mask_cell: int
    across: int
    sample: int
    need_top: int
    need_bottom: int
    need_left: int
    need_right: int


class LayWeights(NamedTuple):
    """Evenness and variety, each times the exemplar's variance, and how much worse than the best may do.

    `phase` is what a sample pays for a unit of `misfit`.
    """

    evenness: float
    variety: float
    tolerance: float
    phase: float


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


class BlockTexels(NamedTuple):
    """Scratch: the texels of a block.

    `rows` and `columns` are the canvas's, and one more each way, -1 where there is none; `marks` is what
    `covered` has there and `old` what is laid; `ys`, `xs` tell where texels fall, in pixels from the centre.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    marks: NDArray[np.uint8]
    old: NDArray[np.int32]
    ys: NDArray[np.int32]
    xs: NDArray[np.int32]


class ChoiceScratch(NamedTuple):
    """Scratch: what a source is chosen by, and candidates.

    `features` (n, 2) are boxes of what is laid, rows and columns from a candidate, and `means` their means.
    `offsets` and `values` are pixels from a candidate and what should be there, in the order in which they
    are compared; `listed` (2, n) are the same in that in which they were found. `penalties` has the shape of
    usage for one symmetry. `wanted` (2, 3) tells for each wave which of the exemplar's shall have which
    phase: its number (-1: none), 1 or -1 for its opposite, the phase. `kept` are candidates as row · width +
    column, `judged` what they cost; `continued` (2, 3) are those that continue the left and upper neighbours:
    candidate (-1: none), and source in 1/16 pixel. `heap`, `costs`, `line` and `misfits` are the search's.
    """

    features: NDArray[np.int64]
    means: NDArray[np.float32]
    offsets: NDArray[np.int32]
    values: NDArray[np.int32]
    listed: NDArray[np.int32]
    penalties: NDArray[np.float64]
    wanted: NDArray[np.int64]
    kept: NDArray[np.int64]
    judged: NDArray[np.int64]
    continued: NDArray[np.int64]
    heap: NDArray[np.float32]
    costs: NDArray[np.float32]
    line: NDArray[np.float32]
    misfits: NDArray[np.int32]


class CutScratch(NamedTuple):
    """Scratch by the cells of a block: `marks` and `missing` see `label_seeds`, the rest `cut_grid`.

    Only `differences` has the texels of a row.
    """

    differences: NDArray[np.int32]
    errors: NDArray[np.int64]
    marks: NDArray[np.int32]
    missing: NDArray[np.int32]
    seeds: NDArray[np.int8]
    residual: NDArray[np.int64]
    work: NDArray[np.int32]


class SymmetryScratch(NamedTuple):
    """Scratch: `shown` (8), how many texels under a block show each symmetry; `tried` (3), those for it."""

    shown: NDArray[np.int64]
    tried: NDArray[np.int64]


class LayScratch(NamedTuple):
    """All scratch of `lay_blocks`."""

    texels: BlockTexels
    choice: ChoiceScratch
    cut: CutScratch
    symmetries: SymmetryScratch

    @classmethod
    def of(cls, numbers: LayNumbers, usage: NDArray[np.float64]) -> "LayScratch":
        """Return scratch for a chart's blocks."""
        height, width = numbers.block_height, numbers.block_width
        cells = height // numbers.mask_cell * (width // numbers.mask_cell)
        box, reach = 4 * numbers.sample, numbers.step // 2
        features = (height // box + 1) * (width // box + 1)
        planes = numbers.symmetries.bit_count()
        columns = (numbers.width + numbers.step - 1) // numbers.step
        most = 2 + numbers.shortlist + REFINED * ((2 * reach + 1) ** 2 - 1)
        return cls(
            BlockTexels(
                np.empty(height + 2, np.int64),
                np.empty(width + 2, np.int64),
                np.empty((height, width), np.uint8),
                np.empty((height, width), np.int32),
                np.empty((height, width), np.int32),
                np.empty((height, width), np.int32),
            ),
            ChoiceScratch(
                np.empty((features, 2), np.int64),
                np.empty(features, np.float32),
                np.empty(height * width, np.int32),
                np.empty(height * width, np.int32),
                np.empty((2, height * width), np.int32),
                np.empty((usage.shape[0] // planes, usage.shape[1])),
                np.zeros((2, 3), np.int64),
                np.empty(most, np.int64),
                np.empty(most, np.int64),
                np.empty((2, 3), np.int64),
                np.empty(most, np.float32),
                np.zeros(columns * max(1, _FEW // columns), np.float32),
                np.empty(columns, np.float32),
                np.empty(columns, np.int32),
            ),
            CutScratch(
                np.empty(width, np.int32),
                np.empty(cells, np.int64),
                np.empty(cells, np.int32),
                np.empty(cells, np.int32),
                np.empty(cells, np.int8),
                np.empty((4, cells), np.int64),
                np.empty((4, cells), np.int32),
            ),
            SymmetryScratch(np.empty(8, np.int64), np.empty(3, np.int64)),
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
def whole_pixels(distance: int, level: int) -> int:
    """Return a distance in 1/16 pixel in whole pixels of a level."""
    return (distance + (8 << level)) >> (4 + level)


@inline
def pixel_at(position: int, level: int) -> int:
    """Return the pixel of a level in which a position in 1/16 pixel lies."""
    return (position + 8) >> (4 + level)


@inline
def position_of(pixel: int, level: int) -> int:
    """Return the middle of a level's pixel, in 1/16 pixel of the exemplar."""
    return ((16 * pixel + 8) << level) - 8


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
