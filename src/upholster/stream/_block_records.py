"""What kernels know of a grid plan's blocks: a record each, and a chart's numbers."""

__all__ = [
    "ACROSS",
    "AGREES",
    "BASE",
    "BLOCK_HEIGHT",
    "BLOCK_WIDTH",
    "CELL",
    "COLUMN",
    "COLUMNS",
    "CUT",
    "EXEMPLAR_HEIGHT",
    "EXEMPLAR_WIDTH",
    "FIRST_COLUMN",
    "FIRST_ROW",
    "HEIGHT",
    "LEVEL",
    "LINK",
    "MARGIN",
    "MATRIX",
    "MODE",
    "OWN",
    "ROW",
    "ROWS",
    "SIZE",
    "SOURCE_COLUMN",
    "SOURCE_ROW",
    "SPEC",
    "STEP_COLUMN",
    "STEP_ROW",
    "SYMMETRY",
    "TRANSFERRED",
    "WIDTH",
]

# Columns of a block's record; after what a placement has: how its source was told; which neighbours it goes
# on from; the block of another chart that was transferred here, -1: none; the size of its mask's cells; its
# turn
# times M at its centre.
ROW, COLUMN, HEIGHT, WIDTH, SYMMETRY, CUT, SOURCE_ROW, SOURCE_COLUMN, MODE, AGREES, LINK, SIZE, MATRIX = (
    range(13)
)
COLUMNS = MATRIX + 4
# Places in a chart's numbers: its transferred blocks; the size of its own, where their grid begins, its
# steps, rows and columns; own blocks so far; margin of its field; exemplar and pyramid level; cell; where its
# records begin.
(
    TRANSFERRED,
    BLOCK_HEIGHT,
    BLOCK_WIDTH,
    FIRST_ROW,
    FIRST_COLUMN,
    STEP_ROW,
    STEP_COLUMN,
    ROWS,
    ACROSS,
    OWN,
    MARGIN,
    EXEMPLAR_HEIGHT,
    EXEMPLAR_WIDTH,
    LEVEL,
    CELL,
    BASE,
) = range(16)
SPEC = 16
