"""Entries for tests to what only kernels call."""

from typing import Any

from upholster.runtime.jit import kernel
from upholster.synthesis.quilt.kernels._block_kernels import LayNumbers
from upholster.synthesis.quilt.kernels._choice_kernels import choose_source, draw_fitting
from upholster.synthesis.quilt.kernels._frame_kernels import keep_to_course, look_at_frame, write_frame
from upholster.synthesis.quilt.kernels._guide_kernels import is_barred, penalise_off, prefer_cells, show_all
from upholster.synthesis.quilt.kernels._seed_kernels import cut_block
from upholster.synthesis.quilt.kernels._sheet_kernels import fit_block, shown_at
from upholster.synthesis.quilt.kernels._unfold_kernels import unfold_block
from upholster.synthesis.quilt.kernels._whole_kernels import place_inside_chart


def lay_numbers(height: int, width: int, size: int, **changes: Any) -> LayNumbers:
    """Return numbers of a sample and of blocks of `size` pixels, with `changes` by name."""
    numbers = LayNumbers(
        height, width, level=0, step=1, shortlist=32, guide_step=4, symmetries=1, size=size, cell=2
    )
    return numbers._replace(**changes)


@kernel
def choose(
    match: Any,
    numbers: Any,
    weights: Any,
    state: Any,
    span: Any,
    pixels: Any,
    choice: Any,
    out: Any,
) -> None:
    """Write the row, the column and the cost that `choose_source` finds."""
    y, x, cost = choose_source(match, numbers, weights, state, span, pixels, choice)
    out[0], out[1], out[2] = y, x, cost


@kernel
def draw_first(match: Any, numbers: Any, weights: Any, state: Any, span: Any, choice: Any, out: Any) -> None:
    """Write the row and the column that `draw_fitting` draws, for each row of `out`."""
    for n in range(out.shape[0]):
        y, x = draw_fitting(match, numbers, weights, state, span, choice)
        out[n, 0], out[n, 1] = y, x


@kernel
def cut(covered: Any, match: Any, numbers: Any, base: int, pixels: Any, scratch: Any, mask: Any) -> None:
    """Call `cut_block`."""
    cut_block(covered, match, numbers, base, pixels, scratch, mask)


@kernel
def ask(match: Any, numbers: Any, span: Any, pixels: Any, choice: Any) -> None:
    """Call `penalise_off`."""
    penalise_off(match, numbers, span, pixels, choice)


@kernel
def bar(pixels: Any, zone: int, cell: int, out: Any) -> None:
    """Write for each cell, `out` (rows, columns), whether it `is_barred`."""
    for a in range(out.shape[0]):
        for b in range(out.shape[1]):
            out[a, b] = is_barred(pixels, zone, cell, a, b)


@kernel
def prefer(match: Any, numbers: Any, base: int, pixels: Any, scratch: Any) -> None:
    """Call `prefer_cells`."""
    prefer_cells(match, numbers, base, pixels, scratch)


@kernel
def show(match: Any, numbers: Any, base: int, pixels: Any, mask: Any) -> None:
    """Call `show_all`."""
    show_all(match, numbers, base, pixels, mask)


@kernel
def lie(field: Any, clear: Any, root: Any, half: float, out: Any, fits: Any) -> int:
    """Call `place_inside_chart`."""
    return int(place_inside_chart(field, clear, root, half, out, fits))


@kernel
def unfold(
    mesh: Any, field: Any, triangle: int, spot: Any, root: Any, half: float, scale: float,
    scratch: Any, sheets: Any, out: Any, fits: Any, sizes: Any,
) -> None:  # fmt: skip
    """Call `unfold_block` and `fit_block`; `sizes` receives triangles and sheets."""
    found, pieces = unfold_block(mesh, triangle, spot, half, scale, scratch, out)
    sizes[0] = found
    sizes[1] = fit_block(mesh, field, root, half, out, (found, pieces), sheets, fits)


@kernel
def look(
    canvases: Any, match: Any, records: Any, found: Any, count: int, inside: Any, covered: Any,
    pixels: Any, symmetries: Any, sizes: Any,
) -> None:  # fmt: skip
    """Call `look_at_frame`; `sizes` receives how many pixels are laid and bare."""
    sizes[0], sizes[1] = look_at_frame(
        canvases, match, records, found, count, inside, covered, pixels, symmetries
    )


@kernel
def write(canvases: Any, numbers: Any, block: int, record: Any, mask: Any, found: Any, count: int) -> None:
    """Call `write_frame`."""
    write_frame(canvases, numbers, block, record, mask, found, count)


@kernel
def read_cells(field: Any, fits: Any, rows: Any, places: Any, read: Any) -> None:
    """Write where places (n, 2) read by sheets `rows` (n,) of `fits`, in frame pixels from the source."""
    for n in range(rows.shape[0]):
        y, x = shown_at(field, fits[rows[n]], places[n, 0], places[n, 1])
        read[n, 0], read[n, 1] = y, x


@kernel
def keep(numbers: Any, record: Any, covered: Any, pixels: Any, sizes: Any) -> None:
    """Call `keep_to_course`; `sizes` receives how many pixels are laid and bare."""
    sizes[0], sizes[1] = keep_to_course(numbers, record, covered, pixels)
