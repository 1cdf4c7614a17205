"""Where transferred blocks lie and read on their other chart, so that both charts show the same at the seam.

2×2 matrices are tuples of four numbers, row by row.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.quilt._field_kernels import matrix_at
from upholster.types import int64

__all__ = ["FITTED", "PLACES", "FieldNodes", "SeamNumbers", "fit_blocks"]

PLACES = 6
"""Columns: row and column on the other chart, then the matrix of steps there to steps on the block's own."""

SYMMETRY, SOURCE_ROW, SOURCE_COLUMN, CENTRED, MATRIX = range(5)
FITTED = MATRIX + 4
"""Columns: symmetry (-1: the block can not be transferred), source, whether centred, centre matrix."""

_WORST_LIKENESS = 2 * np.cos(np.radians(25.0))
"""Nothing is transferred where directions on two charts differ more than by so many degrees from quarter
turns."""

_LEAST_AREA = 1e-6
"""Determinant from which on a map between charts, or a field's matrix, has a usable inverse."""

_SAMPLES = 5
"""Places along a block's part of the seam at which both charts should show the same."""

_WORST_FIT = 0.4
"""Pixels by which two charts may show a block apart along their seam before it gets a matrix of its own."""

_STIFFNESS = 30.0
"""How much a fitted matrix is held to what is expected of it: square pixels per (pixel per texel)²."""

_UNIT, _MATRIX_UNIT = 4096, 64

Matrix = tuple[Any, Any, Any, Any]
Point = tuple[Any, Any]


class SeamNumbers(NamedTuple):
    """A transition without its matrices, see `upholster.charts.transitions.Transition` and its seam."""

    edge: int
    other_edge: int
    start: float
    stop: float
    other_start: float
    other_stop: float
    line: float
    other_line: float


class FieldNodes(NamedTuple):
    """A warp field: its nodes' matrices (rows, columns, 4) in 1/4096, and its margin in nodes."""

    matrices: NDArray[np.int32]
    margin: int


@inline
def _times(a: Matrix, b: Matrix) -> Matrix:
    return (
        a[0] * b[0] + a[1] * b[2],
        a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2],
        a[2] * b[1] + a[3] * b[3],
    )


@inline
def _apply(a: Matrix, p: Point) -> Point:
    return a[0] * p[0] + a[1] * p[1], a[2] * p[0] + a[3] * p[1]


@inline
def _area(a: Matrix) -> Any:
    return a[0] * a[3] - a[1] * a[2]


@inline
def _inverse(a: Matrix) -> Matrix:
    area = _area(a)
    return a[3] / area, -a[1] / area, -a[2] / area, a[0] / area


@inline
def _symmetry(table: NDArray[np.int64], n: int) -> Matrix:
    return float(table[n, 0]), float(table[n, 1]), float(table[n, 2]), float(table[n, 3])


@inline
def _in_pixels(m: Matrix) -> Matrix:
    return m[0] / _UNIT, m[1] / _UNIT, m[2] / _UNIT, m[3] / _UNIT


@inline
def _field_at(field: FieldNodes, row: float, column: float) -> Matrix:
    # M between texels, see `WarpField.at`.
    m, rows, columns = field.matrices, field.matrices.shape[0], field.matrices.shape[1]
    y = min(max(row / 32 + field.margin, 0.0), rows - 1.0)
    x = min(max(column / 32 + field.margin, 0.0), columns - 1.0)
    i, j = min(int64(y), max(rows - 2, 0)), min(int64(x), max(columns - 2, 0))
    below, beside, down, right = min(i + 1, rows - 1), min(j + 1, columns - 1), y - i, x - j
    a, b, c, d = (1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right
    return (
        (a * m[i, j, 0] + b * m[i, beside, 0] + c * m[below, j, 0] + d * m[below, beside, 0]) / _UNIT,
        (a * m[i, j, 1] + b * m[i, beside, 1] + c * m[below, j, 1] + d * m[below, beside, 1]) / _UNIT,
        (a * m[i, j, 2] + b * m[i, beside, 2] + c * m[below, j, 2] + d * m[below, beside, 2]) / _UNIT,
        (a * m[i, j, 3] + b * m[i, beside, 3] + c * m[below, j, 3] + d * m[below, beside, 3]) / _UNIT,
    )


@inline
def _displaced(centre: Matrix, here: Matrix, step: Point) -> Point:
    # How far from its source a block reads, before its symmetry.
    y, x = _apply(centre, step)
    v, w = _apply(here, step)
    return 0.5 * (y + v), 0.5 * (x + w)


@inline
def _carried(seam: SeamNumbers, steps: NDArray[np.float64], row: float, column: float) -> Any:
    # Where a place lies on the other chart, and the matrix of steps there: as `Transition.apply`.
    down = seam.edge & 1
    along, across = (row, column) if down else (column, row)
    foot = min(max(along + 0.5, seam.start), seam.stop)
    share = (foot - seam.start) / (seam.stop - seam.start)
    place = share * (steps.shape[0] - 1)
    n = min(int64(place), steps.shape[0] - 2)
    weight = place - n
    one, two = steps[n], steps[n + 1]
    forth = (
        (1.0 - weight) * one[0, 0] + weight * two[0, 0],
        (1.0 - weight) * one[0, 1] + weight * two[0, 1],
        (1.0 - weight) * one[1, 0] + weight * two[1, 0],
        (1.0 - weight) * one[1, 1] + weight * two[1, 1],
    )
    over, depth = along + 0.5 - foot, across - seam.line
    y, x = _apply(forth, (over, depth) if down else (depth, over))
    other = (1.0 - share) * seam.other_start + share * seam.other_stop - 0.5
    if seam.other_edge & 1:
        return y + other, x + seam.other_line, forth
    return y + seam.other_line, x + other, forth


@inline
def _best_symmetry(before: Matrix, back: Matrix, there: Matrix, table: NDArray[np.int64]) -> Any:
    # The symmetry with which a block is most nearly shown as on its own chart; -1 if none is near enough.
    wanted = _times(_times(before, back), _inverse(there))
    size = np.sqrt(max(1e-12, abs(_area(wanted))))
    best, most = int64(-1), _WORST_LIKENESS
    for n in range(table.shape[0]):
        t = _symmetry(table, n)
        likeness = (wanted[0] * t[0] + wanted[1] * t[1] + wanted[2] * t[2] + wanted[3] * t[3]) / size
        if likeness > most:
            best, most = int64(n), likeness
    return best


@inline
def _on_seam(seam: SeamNumbers, low: float, high: float, k: int) -> Any:
    # The k-th of the places along the seam from `low` to `high`, on either chart.
    along = low + (high - low) * ((k + 0.5) / _SAMPLES)
    slope = (seam.other_stop - seam.other_start) / (seam.stop - seam.start)
    there = seam.other_start + (along - seam.start) * slope
    here_at = (along - 0.5, seam.line) if seam.edge & 1 else (seam.line, along - 0.5)
    there_at = (there - 0.5, seam.other_line) if seam.other_edge & 1 else (seam.other_line, there - 0.5)
    return here_at, there_at


class BlockPair(NamedTuple):
    """A block and its place on the other chart.

    `own` and `other` are the centres, `centre` the block's matrix, `start` its source, all in texels and
    pixels; `turned` is its symmetry, `unturned` the inverse of that on the other chart. `low` and `high` are
    the ends of its part of the seam.
    """

    own: Point
    other: Point
    centre: Matrix
    start: Point
    turned: Matrix
    unturned: Matrix
    low: float
    high: float


@inline
def _seen(pair: BlockPair, seam: SeamNumbers, old: FieldNodes, k: int) -> Any:
    # What the block shows at a place of the seam, in the frame before its symmetry on the other chart; and
    # the place, on the other chart, seen from its centre there.
    here, there = _on_seam(seam, pair.low, pair.high, k)
    step = (here[0] - pair.own[0], here[1] - pair.own[1])
    y, x = _apply(pair.turned, _displaced(pair.centre, _field_at(old, here[0], here[1]), step))
    seen = _apply(pair.unturned, (pair.start[0] + y, pair.start[1] + x))
    return seen, there, (there[0] - pair.other[0], there[1] - pair.other[1])


@inline
def _fit(pair: BlockPair, expected: Matrix, seam: SeamNumbers, old: FieldNodes, new: FieldNodes) -> Matrix:
    # Least squares over places along the seam: the centre matrix which shows there what is seen, near to what
    # is expected of it: a seam is a line, and tells half of it.
    rest_y, rest_x, lever_y, lever_x = 0.0, 0.0, 0.0, 0.0
    yy, yx, xx = 0.0, 0.0, 0.0
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(_SAMPLES):
        seen, there, step = _seen(pair, seam, old, k)
        y, x = _displaced(expected, _field_at(new, there[0], there[1]), step)
        y, x, v, w = seen[0] - y, seen[1] - x, 0.5 * step[0], 0.5 * step[1]
        rest_y, rest_x, lever_y, lever_x = rest_y + y, rest_x + x, lever_y + v, lever_x + w
        yy, yx, xx = yy + v * v, yx + v * w, xx + w * w
        a, b, c, d = a + y * v, b + y * w, c + x * v, d + x * w
    # All about their means.
    n = float(_SAMPLES)
    square = (
        yy - lever_y * lever_y / n + _STIFFNESS,
        yx - lever_y * lever_x / n,
        yx - lever_y * lever_x / n,
        xx - lever_x * lever_x / n + _STIFFNESS,
    )
    moment = (
        a - rest_y * lever_y / n,
        b - rest_y * lever_x / n,
        c - rest_x * lever_y / n,
        d - rest_x * lever_x / n,
    )
    change = _times(moment, _inverse(square))
    return expected[0] + change[0], expected[1] + change[1], expected[2] + change[2], expected[3] + change[3]


@inline
def _source(pair: BlockPair, centre: Matrix, seam: SeamNumbers, old: FieldNodes, new: FieldNodes) -> Any:
    # The source with which a block of this centre matrix shows most nearly the same, before its symmetry, and
    # how far off it is where it is worst.
    total_y, total_x = 0.0, 0.0
    least_y, most_y, least_x, most_x = np.inf, -np.inf, np.inf, -np.inf
    for k in range(_SAMPLES):
        seen, there, step = _seen(pair, seam, old, k)
        y, x = _displaced(centre, _field_at(new, there[0], there[1]), step)
        y, x = seen[0] - y, seen[1] - x
        total_y, total_x = total_y + y, total_x + x
        least_y, most_y, least_x, most_x = min(least_y, y), max(most_y, y), min(least_x, x), max(most_x, x)
    y, x = total_y / _SAMPLES, total_x / _SAMPLES
    return y, x, max(max(most_y - y, y - least_y), max(most_x - x, x - least_x))


@inline
def _stepped(fit: Any, plain: Any) -> Any:
    # A fitted number as a stream tells it: so many steps from the field's.
    return plain + _MATRIX_UNIT * int64(np.rint((fit * _UNIT - plain) / _MATRIX_UNIT))


@inline
def _is_sound(own: Matrix, plain: Matrix) -> bool:
    # Whether a centre matrix is still near M: a fit to a short piece of a seam may be far off.
    apart, size = int64(0), int64(0)
    for n in range(4):
        apart, size = max(apart, abs(own[n] - plain[n])), max(size, abs(plain[n]))
    return bool(_area(own) > 0 and 2 * apart < size)


@inline
def _ends_within(back: Matrix, height: int, width: int, edge: int, size: tuple[int, int]) -> bool:
    # Whether a block is no longer across an edge than the chart is deep there: one that reaches across a thin
    # chart meets another seam, of which a fit to this one knows nothing. Equal but for rounding is equal.
    area = abs(_area(back))
    if edge & 1:
        return bool(abs(back[2]) * height + abs(back[0]) * width <= area * (size[1] + 1e-6))
    return bool(abs(back[3]) * height + abs(back[1]) * width <= area * (size[0] + 1e-6))


@inline
def _matrix_of(block: Any, field: FieldNodes) -> Matrix:
    if block.centred:
        m = block.matrix
        return int64(m[0]), int64(m[1]), int64(m[2]), int64(m[3])
    m0, m1, m2, m3 = matrix_at(field.matrices, field.margin, int64(block.row), int64(block.column))
    return int64(m0), int64(m1), int64(m2), int64(m3)


@inline
def _write(fitted: Any, y: Any, x: Any, turned: Matrix) -> None:
    # In quarters of a pixel: a stream tells them in half the bits, and nobody sees an eighth of a pixel.
    row, column = _apply(turned, (4.0 * y, 4.0 * x))
    fitted[SOURCE_ROW], fitted[SOURCE_COLUMN] = 4 * int64(np.rint(row)), 4 * int64(np.rint(column))


@kernel
def fit_blocks(
    blocks: NDArray[np.void],
    ends: NDArray[np.float64],
    seam: SeamNumbers,
    steps: NDArray[np.float64],
    old: FieldNodes,
    new: FieldNodes,
    size: tuple[int, int],
    symmetries: NDArray[np.int64],
    places: NDArray[np.float64],
    fitted: NDArray[np.int64],
) -> None:
    """Find how blocks of a chart are shown on the chart across a seam.

    `blocks` (n,) of `BLOCK`; `ends` (n, 2), from where to where each reaches along the seam; `steps`
    (samples, 2, 2), the transition's matrices; `old` and `new` the fields of the two charts; `size` the other
    chart's height and width; `symmetries` as in `upholster.quilt.placement`. Writes `places` (n, `PLACES`)
    and `fitted` (n, `FITTED`): the source in 1/16 pixel with which both charts show the same along the seam,
    as nearly as can be; and, where M at the new centre does not do, a centre matrix of the block's own in
    1/4096 pixel per texel, M and multiples of 64. Otherwise M serves: it takes no bytes.
    """
    for n in range(blocks.shape[0]):
        block, out = blocks[n], fitted[n]
        out[SYMMETRY], out[CENTRED] = -1, 0
        own = (float(block.row), float(block.column))
        y, x, forth = _carried(seam, steps, own[0], own[1])
        if not abs(_area(forth)) > _LEAST_AREA:
            continue
        back = _inverse(forth)
        places[n, 0], places[n, 1] = y, x
        places[n, 2], places[n, 3], places[n, 4], places[n, 5] = back
        other = (np.rint(y), np.rint(x))
        there = _field_at(new, other[0], other[1])
        # Between two matrices that point apart, as beside a pole, the field may have no inverse.
        if not abs(_area(there)) > _LEAST_AREA:
            continue
        centre = _in_pixels(_matrix_of(block, old))
        turned = _symmetry(symmetries, int64(block.symmetry))
        out[SYMMETRY] = _best_symmetry(_times(turned, centre), back, there, symmetries)
        if out[SYMMETRY] < 0:
            continue
        t = _symmetry(symmetries, out[SYMMETRY])
        # The inverse: symmetries are orthogonal.
        unturned = (t[0], t[2], t[1], t[3])
        start = (block.source_row / 16.0, block.source_column / 16.0)
        pair = BlockPair(own, other, centre, start, turned, unturned, ends[n, 0], ends[n, 1])
        m0, m1, m2, m3 = matrix_at(new.matrices, new.margin, int64(other[0]), int64(other[1]))
        plain = (int64(m0), int64(m1), int64(m2), int64(m3))
        y, x, error = _source(pair, _in_pixels(plain), seam, old, new)
        _write(out, y, x, t)
        # A matrix of its own is looked for only where it is needed.
        if error <= _WORST_FIT or not _ends_within(back, block.height, block.width, seam.other_edge, size):
            continue
        fit = _fit(pair, _times(unturned, _times(turned, _times(centre, back))), seam, old, new)
        mine = (
            _stepped(fit[0], plain[0]),
            _stepped(fit[1], plain[1]),
            _stepped(fit[2], plain[2]),
            _stepped(fit[3], plain[3]),
        )
        y, x, own_error = _source(pair, _in_pixels(mine), seam, old, new)
        if own_error < 0.75 * error and _is_sound(mine, plain):
            _write(out, y, x, t)
            out[CENTRED] = 1
            out[MATRIX], out[MATRIX + 1], out[MATRIX + 2], out[MATRIX + 3] = mine
