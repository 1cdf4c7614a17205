"""What kernels know of a grid plan's blocks: a record each, and a chart's numbers."""

from typing import NamedTuple

__all__ = [
    "AGREES",
    "CENTRE",
    "CENTRED",
    "CHART",
    "COLUMN",
    "COLUMNS",
    "CUT",
    "HEIGHT",
    "LINK",
    "MATRIX",
    "MODE",
    "PLACE",
    "ROW",
    "SIZE",
    "SOURCE_COLUMN",
    "SOURCE_ROW",
    "SYMMETRY",
    "WIDTH",
    "ChartNumbers",
]

# Columns of a block's record: what a placement has; how its source was told; which neighbours it goes on
# from; the block that it was transferred from, -1: none known; the size of its mask's cells; whether it has a
# centre matrix of its own; its centre matrix; its symmetry times that; its chart; where a transferred block
# shows what the block that it comes from has at its centre, in 1/64 texel.
ROW, COLUMN, HEIGHT, WIDTH, SYMMETRY, CUT, SOURCE_ROW, SOURCE_COLUMN = range(8)
MODE, AGREES, LINK, SIZE, CENTRED, CENTRE = range(8, 14)
MATRIX = CENTRE + 4
CHART, PLACE = MATRIX + 4, MATRIX + 5
COLUMNS = PLACE + 2


class ChartNumbers(NamedTuple):
    """A chart's number and grid, and what else coding its blocks needs.

    `turned` is 1 where own blocks have symmetries of their own, 0 where all have symmetry 0. `base` is where
    its records begin, `margin` that of its warp field; `tall` and `wide` are its size in
    texels, `exemplar_height` and `exemplar_width` the exemplar's in pixels.
    """

    chart: int
    transferred: int
    height: int
    width: int
    first_row: int
    first_column: int
    step_row: int
    step_column: int
    rows: int
    across: int
    level: int
    mask_cell: int
    feather: int
    turned: int
    base: int
    margin: int
    tall: int
    wide: int
    exemplar_height: int
    exemplar_width: int
