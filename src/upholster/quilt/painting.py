"""Painting: a quilt and an exemplar give texels.

Painting is linear in the exemplar and knows nothing of how the quilt was made: any image of the exemplar's
height and width can be painted, with any number of channels and at any depth.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.image import Material
from upholster.image.source import as_exemplar
from upholster.parallel import check_running, run_tasks
from upholster.quilt._paint_kernels import paint_strip, weight_rows
from upholster.quilt._warp_kernels import PyramidWords, settle_strip, warp_strip
from upholster.quilt.displacement import centre_matrices, levels_of
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.pyramid import Pyramid, build_pyramid, most_levels
from upholster.types import IntArray, PixelArray, Progress, frozen_array

__all__ = ["CANVAS_DTYPES", "check_painted", "fill_bare", "paint", "paint_each"]

CANVAS_DTYPES = {
    np.dtype(np.uint8): np.uint16,
    np.dtype(np.uint16): np.int32,
    np.dtype(np.float32): np.float32,
}
"""What the canvas holds for samples of each depth: integers get 6 fractional bits."""

_STRIP_SAMPLES = 96 * 1024
_STRIP_WORDS = 64 * 1024
_TASK_TEXELS, _LEAST_TEXELS = 2**21, 2**16


def paint(
    quilt: Quilt, exemplar: PixelArray, *, threads: int | None = None, progress: Progress | None = None
) -> Texels:
    """Paint a quilt with an exemplar, or with any other image of the same shape.

    Placements are painted in order; each covers what is there with weights of 0 to 256, in integers with 6
    fractional bits that are rounded once at the end (float samples: the same formula, unrounded). On charts
    with a warp field the image is sampled bilinearly, from a prefiltered pyramid where it is minified. A
    chart without placements shows the image's mean. The result does not depend on the number of threads.

    Parameters
    ----------
    quilt
        Where each block comes from.
    exemplar
        (H, W) or (H, W, C) with the height and width the quilt was made for; uint8, uint16 or float. Or
        the path of such an image.
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
    exemplar = check_painted(quilt, exemplar)
    check_running(threads, progress)
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape or exemplar.shape[2] == 0:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"image to paint has shape {exemplar.shape}; the quilt wants ({height}, {width}, channels)"
        )
    if exemplar.dtype not in CANVAS_DTYPES:
        raise InputError(f"image to paint is of {exemplar.dtype}; allowed: uint8, uint16, float16, 32, 64")
    which = np.zeros(len(quilt.placements), np.int64)
    texels = paint_each(quilt, (exemplar,), which, threads=threads, progress=progress)
    fill_bare(quilt, exemplar, texels)
    return replace(texels, exemplar=exemplar)


def fill_bare(quilt: Quilt, image: PixelArray, texels: Texels) -> None:
    """Give charts without placements an image's mean (SPEC.md, section 8)."""
    bare = [array for n, array in enumerate(texels.arrays) if not len(quilt.on_chart(n))]
    if not bare:
        return
    flat = image.reshape(-1, image.shape[2])
    if image.dtype == np.float32:
        # One sample after the other, so that every decoder gets the same.
        mean = np.cumsum(flat, axis=0, dtype=np.float64)[-1] / len(flat)
    else:
        mean = (2 * flat.sum(axis=0, dtype=np.int64) + len(flat)) // (2 * len(flat))
    for array in bare:
        array[:] = mean.astype(image.dtype)


def check_painted(quilt: object, image: object) -> PixelArray:
    """Return the array that a quilt is to be painted with, read from its file where one is named.

    Raises
    ------
    InputError
        If it is no quilt, or the image is none.
    """
    if not isinstance(quilt, Quilt):
        raise InputError(f"quilt is a {type(quilt).__name__}; allowed: a Quilt, of `upholster.synthesize`")
    if isinstance(image, (str, os.PathLike)):
        image = as_exemplar(image)
    if isinstance(image, Material):
        raise InputError("image to paint is a material; allowed: an array, or `upholster.paint_material`")
    if not isinstance(image, np.ndarray):
        raise InputError(f"image to paint is a {type(image).__name__}; allowed: a NumPy array or a path")
    image = np.asarray(image)[:, :, None] if image.ndim == 2 else np.asarray(image)
    return image.astype(np.float32) if image.dtype in (np.float16, np.float64) else image


def paint_each(
    quilt: Quilt,
    images: Sequence[PixelArray],
    which: NDArray[np.int64],
    *,
    rows: tuple[int, int] | None = None,
    pyramid: Pyramid | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Texels:
    """Paint each placement with an image of its own, `images[which[n]]`: all of one shape and dtype.

    Charts without placements are left as they come, see `fill_bare`; so are, of every chart, all rows but
    those from, to in `rows`, where they are given. `pyramid` is that of the images, if it is there already.
    """
    (height, _, channels), dtype = images[0].shape, images[0].dtype
    flat = np.concatenate(images) if len(images) > 1 else np.ascontiguousarray(images[0])
    flat = flat.reshape(len(flat), -1)
    placed = quilt.placements
    if len(images) > 1:
        placed = placed.copy()
        placed["source_row"] += (16 * height * which).astype(np.int32)
        frozen_array(placed)
    starts = np.searchsorted(placed["chart"], np.arange(len(quilt.charts) + 1))
    # In one piece of memory, which goes back to the system in one piece.
    ends = np.cumsum([0, *(chart.height * chart.width * channels for chart in quilt.charts)])
    memory = np.empty(ends[-1], dtype)
    arrays = tuple(
        memory[ends[n] : ends[n + 1]].reshape(chart.height, chart.width, channels)
        for n, chart in enumerate(quilt.charts)
    )
    centres = [
        None if copied else centre_matrices(field, quilt.on_chart(index))
        for index, (field, copied) in enumerate(zip(quilt.fields, quilt.copied, strict=True))
    ]
    chosen, deepest = _levels(centres, np.diff(starts), most_levels(*quilt.exemplar_shape))
    if pyramid is None and deepest >= 0:
        pyramid = build_pyramid(images, deepest)
    levels = 0 if pyramid is None else len(pyramid.levels) // len(images)
    pieces: list[tuple[int, Callable[[], object]]] = []
    for index, (chart, array) in enumerate(zip(quilt.charts, arrays, strict=True)):
        out, mine = array.reshape(chart.height, -1), slice(*starts[index : index + 2])
        matrices = centres[index]
        if mine.start == mine.stop:
            continue
        step = max(1, _TASK_TEXELS // chart.width)
        top, bottom = rows or (0, chart.height)
        for start in range(top, bottom, step):
            stop = min(start + step, bottom)
            if matrices is None or pyramid is None:
                piece = partial(_paint_part, quilt, placed[mine], flat, out, channels, start, stop)
            else:
                blocks = matrices, chosen[mine] + which[mine] * levels
                piece = partial(_warp_part, quilt, index, pyramid, blocks, out, channels, start, stop)
            pieces.append(((stop - start) * chart.width, piece))
    run_tasks(_gathered(pieces), threads=threads, progress=progress, stage="paint")
    return Texels(quilt.charts, arrays, quilt)


def _levels(
    centres: Sequence[IntArray | None], counts: NDArray[np.intp], most: int
) -> tuple[NDArray[np.int64], int]:
    # Each placement's level, chart after chart, and the greatest; -1 where no chart has matrices.
    levels = np.zeros(counts.sum(), np.int64)
    warped = [matrices for matrices in centres if matrices is not None]
    if not warped:
        return levels, -1
    found = levels_of(np.concatenate(warped), most)
    levels[np.repeat([matrices is not None for matrices in centres], counts)] = found
    return levels, int(found.max(initial=0))


def _gathered(pieces: list[tuple[int, Callable[[], object]]]) -> list[Callable[[], object]]:
    # Pieces of work and their texels as tasks: many small charts are one, for each task costs time to start.
    tasks: list[Callable[[], object]] = []
    gathered: list[Callable[[], object]] = []
    texels = 0
    for n, (count, piece) in enumerate(pieces, 1):
        gathered.append(piece)
        texels += count
        if texels >= _LEAST_TEXELS or n == len(pieces):
            tasks.append(partial(_call_each, gathered))
            gathered, texels = [], 0
    return tasks


def _call_each(functions: list[Callable[[], object]]) -> None:
    for function in functions:
        function()


def _paint_part(
    quilt: Quilt,
    placements: NDArray[np.void],
    exemplar: PixelArray,
    out: PixelArray,
    channels: int,
    start: int,
    stop: int,
) -> None:
    rows = min(stop - start, max(64, _STRIP_SAMPLES // out.shape[1]))
    canvas = np.empty((rows, out.shape[1]), CANVAS_DTYPES[exemplar.dtype])
    scratch = _scratch(2, quilt, rows)
    for first in range(start, stop, len(canvas)):
        last = min(first + len(canvas), stop)
        paint_strip(
            placements[_touching(placements, first, last)],
            quilt.mask_cells,
            exemplar,
            channels,
            SYMMETRIES,
            scratch,
            first,
            len(out),
            canvas[: last - first],
            out[first:last],
        )


def _scratch(count: int, quilt: Quilt, rows: int) -> NDArray[np.int32]:
    # For the weights of any placement in so many rows of a chart.
    height, width = quilt.largest_block
    return np.empty((count, weight_rows(rows, height), width), np.int32)


def _touching(placements: NDArray[np.void], first: int, last: int) -> NDArray[np.bool_]:
    # Which placements touch rows [first, last) of their chart.
    tops = placements["row"] - placements["height"] // 2
    touching: NDArray[np.bool_] = (tops < last) & (tops + placements["height"] > first)
    return touching


def _warp_part(
    quilt: Quilt,
    chart: int,
    pyramid: Pyramid,
    blocks: tuple[IntArray, NDArray[np.int64]],  # their centre matrices and levels
    out: PixelArray,
    channels: int,
    start: int,
    stop: int,
) -> None:
    field = quilt.fields[chart]
    height, width = quilt.charts[chart].height, quilt.charts[chart].width
    across = width * pyramid.per_pixel
    canvas = np.empty((min(stop - start, max(64, _STRIP_WORDS // across)), across), pyramid.words.dtype)
    words = PyramidWords(pyramid.words, pyramid.per_pixel, 8 * pyramid.lane.itemsize, pyramid.levels)
    placements, (centres, levels) = quilt.on_chart(chart), blocks
    scratch = _scratch(4, quilt, len(canvas))
    for first in range(start, stop, len(canvas)):
        part = canvas[: stop - first]
        last = first + len(part)
        touching = _touching(placements, first, last)
        warp_strip(
            placements[touching],
            centres[touching],
            levels[touching],
            quilt.mask_cells,
            field.matrices,
            field.margin,
            SYMMETRIES,
            words,
            scratch,
            first,
            height,
            part,
        )
        if pyramid.lane == np.float32:
            out[first:last] = part
        else:
            settle_strip(part.view(pyramid.lane).reshape(len(part), width, -1), channels, out[first:last])
