"""Painting: a quilt and an exemplar give texels.

Painting is linear in the exemplar and knows nothing of how the quilt was made: any image of the exemplar's
height and width can be painted, with any number of channels and at any depth.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from upholster.errors import InputError
from upholster.parallel import run_tasks
from upholster.synthesis._paint_kernels import TURNS, paint_rows
from upholster.synthesis.quilt import Quilt, Texels
from upholster.types import PixelArray, Progress

__all__ = ["CANVAS_DTYPES", "paint"]

CANVAS_DTYPES = {
    np.dtype(np.uint8): np.uint16,
    np.dtype(np.uint16): np.int32,
    np.dtype(np.float32): np.float32,
}
"""What the canvas holds for samples of each depth: integers get 6 fractional bits."""

_STRIP_SAMPLES = 96 * 1024
_TASK_TEXELS = 2**21


def paint(
    quilt: Quilt, exemplar: PixelArray, *, threads: int | None = None, progress: Progress | None = None
) -> Texels:
    """Paint a quilt with an exemplar, or with any other image of the same shape.

    Placements are painted in order; each covers what is there with weights of 0 to 256, in integers with 6
    fractional bits that are rounded once at the end (float samples: the same formula, unrounded). The result
    does not depend on the number of threads.

    Parameters
    ----------
    quilt
        Where each block comes from.
    exemplar
        (H, W, C) with the height and width the quilt was made for; uint8, uint16 or float32.
    threads, progress
        As in `upholster.parallel.run_tasks`.

    Returns
    -------
    Texels
        One (height, width, C) array per chart, of the exemplar's dtype.

    Raises
    ------
    InputError
        For another height, width or dtype.
    """
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape or exemplar.shape[2] == 0:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"image to paint has shape {exemplar.shape}; the quilt wants ({height}, {width}, channels)"
        )
    if exemplar.dtype not in CANVAS_DTYPES:
        raise InputError(f"image to paint is of {exemplar.dtype}; allowed: uint8, uint16, float32")
    channels = exemplar.shape[2]
    flat = np.ascontiguousarray(exemplar).reshape(exemplar.shape[0], -1)
    # In one piece of memory, which goes back to the system in one piece.
    ends = np.cumsum([0, *(chart.height * chart.width * channels for chart in quilt.charts)])
    memory = np.empty(ends[-1], exemplar.dtype)
    arrays = tuple(
        memory[ends[n] : ends[n + 1]].reshape(chart.height, chart.width, channels)
        for n, chart in enumerate(quilt.charts)
    )
    tasks: list[Callable[[], object]] = []
    for index, (chart, array) in enumerate(zip(quilt.charts, arrays, strict=True)):
        rows = max(1, _TASK_TEXELS // chart.width)
        tasks += [
            partial(_paint_part, quilt, index, flat, array, start, min(start + rows, chart.height))
            for start in range(0, chart.height, rows)
        ]
    run_tasks(tasks, threads=threads, progress=progress, stage="paint")
    return Texels(quilt.charts, arrays)


def _paint_part(
    quilt: Quilt, chart: int, exemplar: PixelArray, array: PixelArray, start: int, stop: int
) -> None:
    out = array.reshape(array.shape[0], -1)
    strip = min(stop - start, max(64, _STRIP_SAMPLES // out.shape[1]))
    canvas = np.empty((strip, out.shape[1]), CANVAS_DTYPES[exemplar.dtype])
    placements = quilt.on_chart(chart)
    scratch = np.empty((2, *quilt.largest_block), np.int32)
    paint_rows(placements, quilt.cells, exemplar, array.shape[2], TURNS, canvas, scratch, start, stop, out)
