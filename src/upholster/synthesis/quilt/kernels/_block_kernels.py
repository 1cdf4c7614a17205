"""Blocks in the kernels of method "quilt": their arrays and numbers, and small functions for all kernels."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.runtime.jit import inline

__all__ = [
    "BLOCK_COLUMNS",
    "EITHER",
    "MOST_NEAR",
    "MULTIPLIER",
    "OUTCOME",
    "PHASE",
    "REFINED",
    "SOURCE_COLUMN",
    "SOURCE_ROW",
    "SYMMETRY",
    "ChoiceScratch",
    "CourseRule",
    "CutScratch",
    "FramePixels",
    "LayNumbers",
    "LayWeights",
    "MatchImage",
    "Span",
    "squared_difference",
]

# Columns of a block's record: the pixel that its centre reads, its symmetry, and whether it was laid on other
# blocks (1), laid on bare steps only (2), or not needed (0). The last ones are the phases that the surface
# requests at the centre, for at most two waves, in 1/65536 turn.
SOURCE_ROW, SOURCE_COLUMN, SYMMETRY, OUTCOME, PHASE = range(5)
BLOCK_COLUMNS = PHASE + 2

EITHER = 128
"""Added to a step's zone near its border: blocks of another zone may show there."""

_FEW = 4096
"""Number of candidates that are searched at a time, so that their costs stay in the fastest memory."""

MOST_NEAR = 128
"""Maximum number of nearby blocks whose sources a block avoids."""

MULTIPLIER = 0xD1342543DE82EF95
"""Difference of the seeds of two successive blocks' random generators, modulo 2^64, and of `_scattered`."""

REFINED = 4
"""Number of the best candidates whose surroundings are searched."""


class MatchImage(NamedTuple):
    """The exemplar in its matching form, and its boxes' means `plane`, see `mean_boxes`.

    A pixel of `image` (H · W) is a number of four channels, 8 bits each: see `squared_difference`. `phases`
    (n, H · W) are its waves' phases; n = 0 if phases do not count. `shown` (8, n) is the wave that each
    symmetry shows in place of each wave: k + 1 for wave k, -k - 1 for its opposite, 0 for none. With several
    zones, their rows are one below the other.
    `allowed` (H · W) is the number of the zone at each pixel where a block may have its source, 0 at other
    pixels, and `places` lists the allowed pixels; (0,): all are allowed. `guides` (K, H · W) is each pixel's
    value in each of the K guides, and `costs` (K, 256) is the cost of each difference from a request.
    """

    image: NDArray[np.int32]
    plane: NDArray[np.float32]
    phases: NDArray[np.int16]
    shown: NDArray[np.int8]
    allowed: NDArray[np.uint8]
    places: NDArray[np.int64]
    guides: NDArray[np.uint8]
    costs: NDArray[np.int32]


class CourseRule(NamedTuple):
    """Where the course of a block ends, in which alone it shows, if courses slip.

    A block's place in its course is the sum of its two requested phases, each times 1 or −1 (`first`,
    `second`), minus that of a joint (`joint`), in turns, without whole turns: 0 to 1 from joint to joint. It
    grows by `down` and `right` turns per pixel of the frame. On bare steps a block shows `spare` turns more,
    so that no slivers stay between courses. `spare` is 0 if courses do not slip.
    """

    first: float = 0.0
    second: float = 0.0
    joint: float = 0.0
    down: float = 0.0
    right: float = 0.0
    spare: float = 0.0


class LayNumbers(NamedTuple):
    """Numbers of the sample and of blocks.

    `height`, `width` are the exemplar's on `level`, with `fringe` pixels around it that mirror it: a block's
    frame may reach there, but its cells there stay as they are. Candidates are `step` pixels apart, and
    `shortlist` of them are judged; places at which guides are compared are `guide_step` pixels apart. Blocks
    may have symmetry n if bit n of `symmetries` is 1. A block's frame is `size` × `size` pixels, its mask's
    cells are `cell` pixels wide. `course` says where it ends if courses slip.
    """

    height: int
    width: int
    level: int
    step: int
    shortlist: int
    guide_step: int
    symmetries: int
    size: int
    cell: int
    fringe: int = 0
    course: CourseRule = CourseRule()


class LayWeights(NamedTuple):
    """Weights of matching.

    A source costs up to `chance` times more, at random, and `variety` times more for each nearby block that
    shows all of it. `phase` is the cost of a unit of `misfit` for each sample. `relay` is the least that
    laying again must gain, for each pixel of a frame's side. `floor` is the cost of a perfect fit for each
    sample, so that use counts there, too.
    """

    variety: float
    chance: float
    phase: float
    relay: float
    floor: float


class Span(NamedTuple):
    """The first and last pixels that a block's centre may read, and the range of its texels from there."""

    first_y: int
    last_y: int
    first_x: int
    last_x: int
    low_y: int
    high_y: int
    low_x: int
    high_x: int


class FramePixels(NamedTuple):
    """Scratch: the pixels of a block's frame, arrays (size, size).

    `marks` are the marks of `_frame_kernels`, and `old` the pixels that are laid; `ys`, `xs` are where pixels
    read, relative to the source. `wanted` (K, size, size) are the values that guides request, 0 without a
    request, and `off` is the laid pixels' cost by these; (0, 0): there are no guides. `zones` is the
    requested zone, see `upholster.synthesis.quilt.steering.Steering`; (0, 0): there are no zones. `steps` is
    the canvases' step at each pixel, −1 for none.
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
        """Return scratch for a frame of size × size pixels and a number of guides."""
        shape = (size, size)
        return cls(
            np.empty(shape, np.uint8),
            np.empty(shape, np.int32),
            np.empty(shape, np.int32),
            np.empty(shape, np.int32),
            np.zeros((guides, size, size), np.uint8),
            np.zeros(shape if guides else (0, 0), np.int32),
            np.zeros(shape if zones else (0, 0), np.uint8),
            np.zeros(shape, np.int64),
        )


class ChoiceScratch(NamedTuple):
    """Scratch: the samples by which a source is chosen, and candidates.

    `features` (n, 2) are boxes of laid pixels, rows and columns relative to a candidate, and `means`
    their means. `offsets` and `values` are pixels relative to a candidate and the values that they should
    have, in the order of comparison; `listed` (2, n) are the same in the order of the frame. `penalties`
    are the costs of places by guides, every `guide_step` pixels. `near` (`MOST_NEAR`, 2) are the sources of
    laid blocks nearby, row and column, and `nearby` (1,) is their number. `wanted` (2, 3) is for each wave
    the exemplar's wave that should have a phase: its number (-1: none), 1 or -1 for its opposite, and the
    phase. `zone` (1,) is the zone of the source, 0 for any. `avoid` (1,) is a pixel far from which the source
    must be, −1 for none. `kept` are candidates as row · width + column, `judged` are their costs. `heap`,
    `costs`, `line`, `uses` and `misfits` belong to the search.
    """

    features: NDArray[np.int64]
    means: NDArray[np.float32]
    offsets: NDArray[np.int32]
    values: NDArray[np.int32]
    listed: NDArray[np.int32]
    penalties: NDArray[np.float64]
    near: NDArray[np.int64]
    wanted: NDArray[np.int64]
    zone: NDArray[np.int64]
    avoid: NDArray[np.int64]
    nearby: NDArray[np.int64]
    kept: NDArray[np.int64]
    judged: NDArray[np.int64]
    heap: NDArray[np.float32]
    costs: NDArray[np.float32]
    line: NDArray[np.float32]
    uses: NDArray[np.float64]
    misfits: NDArray[np.int32]

    @classmethod
    def of(cls, numbers: LayNumbers) -> "ChoiceScratch":
        """Return scratch for frames of the size in `numbers`."""
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
            np.zeros((-(-numbers.height // numbers.guide_step), -(-numbers.width // numbers.guide_step))),
            np.empty((MOST_NEAR, 2), np.int64),
            np.zeros((2, 3), np.int64),
            np.zeros(1, np.int64),
            np.full(1, -1, np.int64),
            np.zeros(1, np.int64),
            np.empty(most, np.int64),
            np.empty(most, np.int64),
            np.empty(most, np.float32),
            np.zeros(columns * max(1, _FEW // columns), np.float32),
            np.empty(columns, np.float32),
            np.empty(columns),
            np.empty(columns, np.int32),
        )


class CutScratch(NamedTuple):
    """Scratch for the cells of a block: for `marks`, `missing`, `barred` see `_label_seeds`, else `cut_grid`.

    `balance` is how strongly each cell should be new by the guides. Only `differences` is for texels, those
    of one row.
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
        """Return scratch for frames of the size in `numbers`."""
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

    All numbers have 32 bits, so that compiled code processes several pixels at a time.
    """
    low = np.int32(255)
    a = np.int32(np.int32(one & low) - np.int32(other & low))
    b = np.int32(np.int32((one >> np.int32(8)) & low) - np.int32((other >> np.int32(8)) & low))
    c = np.int32(np.int32((one >> np.int32(16)) & low) - np.int32((other >> np.int32(16)) & low))
    d = np.int32(np.int32((one >> np.int32(24)) & low) - np.int32((other >> np.int32(24)) & low))
    return np.int32(np.int32(np.int32(a * a) + np.int32(b * b)) + np.int32(np.int32(c * c) + np.int32(d * d)))
