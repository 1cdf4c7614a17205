"""Painting: a quilt and an exemplar give texels, with any number of texels per step.

Painting is linear in the exemplar and does not depend on how the quilt was made. Any image of the exemplar's
height and width can be painted, with any number of channels, at any depth and any density.
"""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import PixelArray, Progress
from upholster.image.files.material import Material
from upholster.image.files.source import as_exemplar
from upholster.quilt import _paint_kernels as kernels
from upholster.quilt._reading_kernels import PyramidWords, Readings
from upholster.quilt._tone_kernels import MOST_OTHERS, REACH, Nodes, Scratch, cell_tones
from upholster.quilt.chart import MAX_CHART, MAX_TEXELS, Chart
from upholster.quilt.displacement import centre_matrices, levels_of
from upholster.quilt.labels import LabelMap, cell_centres
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.placement import SYMMETRIES
from upholster.quilt.pyramid import Pyramid, build_pyramid, most_levels
from upholster.quilt.warp_field import UNIT
from upholster.runtime.parallel import run_tasks, running

__all__ = [
    "PAINTED_DENSITIES",
    "ChartPainter",
    "check_painted",
    "image_pyramid",
    "paint",
    "paint_each",
    "painted_charts",
    "texel_places",
]

PAINTED_DENSITIES = 1 / 64, 64
"""Least and greatest density that can be painted: texels per step, each way."""

_DTYPES = np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float32)
_TASK_TEXELS, _LEAST_TEXELS = 2**18, 2**16


def paint(
    quilt: Quilt,
    exemplar: PixelArray,
    *,
    density: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Texels:
    """Paint a quilt with an exemplar, or with any other image of the same shape.

    A texel's colour is the sum over the placements that the four surrounding cell centres name: bilinear
    weights times the values that each placement reads there, in integers that are rounded once (for float
    samples the same formula in 32 bits). The image is sampled bilinearly, from a prefiltered pyramid where it
    is minified. The result does not depend on the number of threads.

    Parameters
    ----------
    quilt
        The origin of each block.
    exemplar
        (H, W) or (H, W, C) with the height and width that the quilt was made for; uint8, uint16 or float. Or
        the path of such an image.
    density
        Texels per step of the quilt's grid, each way: 1/64 to 64. Every density shows the same picture. None:
        the density that the quilt was made for.
    threads, progress
        As in `upholster.runtime.parallel.running`; stage "paint".

    Returns
    -------
    Texels
        One (height, width, C) array per chart, of the exemplar's dtype; its charts are `painted_charts`.

    Raises
    ------
    InputError
        For another height, width or dtype, or a density outside its range.
    """
    exemplar = check_painted(quilt, exemplar)
    if exemplar.ndim != 3 or exemplar.shape[:2] != quilt.exemplar_shape or exemplar.shape[2] == 0:
        height, width = quilt.exemplar_shape
        raise InputError(
            f"image to paint has shape {exemplar.shape}; the quilt wants ({height}, {width}, channels)"
        )
    if exemplar.dtype not in _DTYPES:
        raise InputError(f"image to paint is of {exemplar.dtype}; allowed: uint8, uint16, float16, 32, 64")
    with running(threads, progress):
        texels = paint_each(quilt, image_pyramid((exemplar,), quilt, density), density=density)
    return replace(texels, exemplar=exemplar)


def painted_charts(charts: Sequence[Chart], density: float) -> tuple[Chart, ...]:
    """Return charts as they are painted: with `density` times as many texels as steps, rounded, at least 1.

    Raises
    ------
    InputError
        For a density out of range, or one at which a chart or all charts together have too many texels.
    """
    least, most = PAINTED_DENSITIES
    if isinstance(density, bool) or not isinstance(density, (int, float)) or not least <= density <= most:
        raise InputError(f"density is {density!r}; allowed: {least} to {most} texels for a step")
    if density == 1:
        return tuple(charts)
    found = tuple(
        replace(chart, height=_texels(chart.height, density), width=_texels(chart.width, density))
        for chart in charts
    )
    largest = max(max(chart.height, chart.width) for chart in found)
    texels = sum(chart.height * chart.width for chart in found)
    if largest > MAX_CHART or texels > MAX_TEXELS:
        raise InputError(
            f"density {density} makes {texels:,} texels, {largest:,} along a side; "
            f"allowed: {MAX_TEXELS:,}, {MAX_CHART:,}"
        )
    return found


def _texels(steps: int, density: float) -> int:
    return max(1, math.floor(steps * density + 0.5))


def check_painted(quilt: object, image: object) -> PixelArray:
    """Return the array with which to paint a quilt, read from its file if it is a path.

    Raises
    ------
    InputError
        If the quilt is not a quilt, or the image is not an image.
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


def image_pyramid(images: Sequence[PixelArray], quilt: Quilt, density: float | None = None) -> Pyramid:
    """Return the pyramid that painting a quilt reads, from images (H, W, C) of one shape and dtype."""
    most = most_levels(*images[0].shape[:2])
    charts = painted_charts(quilt.charts, quilt.density if density is None else density)
    read = [_levels_read(quilt, n, chart, most)[1] for n, chart in enumerate(charts)]
    return build_pyramid(images, most, set(np.concatenate(read).tolist()))


def _levels_read(
    quilt: Quilt, index: int, painted: Chart, most: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the centre matrices (n, 4) of a chart's placements, and the levels (n,) that they read."""
    chart = quilt.charts[index]
    ratio = (painted.height * painted.width) / (chart.height * chart.width)
    centres = centre_matrices(quilt.fields[index], quilt.on_chart(index)).astype(np.int64)
    return centres, levels_of(centres, most, ratio=ratio)


def paint_each(
    quilt: Quilt,
    pyramid: Pyramid,
    which: NDArray[np.int64] | None = None,
    *,
    density: float | None = None,
) -> Texels:
    """Paint each placement with its own image, `which[n]` of the pyramid's images; None: the first."""
    charts = painted_charts(quilt.charts, quilt.density if density is None else density)
    channels = pyramid.channels
    # A single allocation, which returns to the system as one piece.
    ends = np.cumsum([0, *(chart.height * chart.width * channels for chart in charts)])
    memory = np.zeros(ends[-1], pyramid.dtype)
    arrays = tuple(
        memory[ends[n] : ends[n + 1]].reshape(chart.height, chart.width, channels)
        for n, chart in enumerate(charts)
    )
    pieces: list[tuple[int, Callable[[], object]]] = []
    for index, (chart, array) in enumerate(zip(charts, arrays, strict=True)):
        painter = ChartPainter(quilt, index, chart, pyramid, which)
        step = max(1, _TASK_TEXELS // chart.width)
        for start in range(0, chart.height, step):
            stop = min(start + step, chart.height)
            window = slice(start, stop), slice(0, chart.width)
            piece = partial(painter.paint, window, array[start:stop])
            pieces.append(((stop - start) * chart.width, piece))
    run_tasks(_gathered(pieces), stage="paint")
    return Texels(charts, arrays, quilt)


@dataclass(frozen=True, eq=False)
class ChartPainter:
    """Paints windows of one chart.

    Attributes
    ----------
    quilt, index
        The chart's quilt, and its number in the quilt.
    painted
        The chart as it is painted, one of `painted_charts`.
    pyramid, which
        As in `paint_each`.
    """

    quilt: Quilt
    index: int
    painted: Chart
    pyramid: Pyramid
    which: NDArray[np.int64] | None = None

    def paint(self, window: tuple[slice, slice], out: PixelArray) -> None:
        """Paint rows and columns of texels, and no other texels.

        `out` is (rows, columns, channels) of the pyramid's dtype, all 0; it receives the texels.
        """
        chart, field, pyramid = self.quilt.charts[self.index], self.quilt.fields[self.index], self.pyramid
        rows = texel_places(chart.height, self.painted.height)[window[0]]
        columns = texel_places(chart.width, self.painted.width)[window[1]]
        first, *further = (_layer(each, rows, columns) for each in self.quilt.labels[self.index])
        second = further[0] if further else first._replace(labels=np.zeros((0, 0), np.int32))
        matrices = np.ascontiguousarray(field.matrices)
        words = PyramidWords(pyramid.words, pyramid.per_pixel, pyramid.bits, pyramid.table)
        line = np.empty((matrices.shape[1], 4), np.int64)
        kernels.paint_window(
            first,
            second,
            self._tone(first, matrices, words),
            self._readings,
            kernels.Field(matrices, field.margin, line, np.empty((2, out.shape[1]), np.int32)),
            words,
            np.empty((out.shape[1], 2 * pyramid.per_pixel), pyramid.words.dtype),
            out,
        )

    def _tone(self, layer: kernels.Layer, matrices: NDArray[np.int32], words: PyramidWords) -> kernels.Tone:
        """Return the tones of the cells around a window; none if the quilt has none."""
        dtype = np.dtype(np.float32 if self.pyramid.dtype == np.float32 else np.int32)
        if not self.quilt.has_tones or not (len(layer.rows.cell) and len(layer.columns.cell)):
            return kernels.Tone(np.empty((0, 0, 0), dtype), 0, 0)
        chart, labels = self.quilt.labels[self.index][0], layer.labels
        first = int(layer.rows.cell[0]), int(layer.columns.cell[0])
        last = int(layer.rows.cell[-1]) + 1, int(layer.columns.cell[-1]) + 1
        channels = self.pyramid.channels
        toned = channels - (1 - channels % 2)  # without alpha
        cells = np.empty((last[0] - first[0] + 1, last[1] - first[1] + 1, toned), dtype)
        rows, columns = (cell_centres(n, chart.cell, half=chart.half) for n in labels.shape)
        scratch = Scratch(
            np.empty((2 * REACH + 1, labels.shape[1]), np.int32),
            np.empty((MOST_OTHERS, 2), np.int32),
            np.empty((2, toned), dtype),
        )
        nodes = Nodes(matrices, self.quilt.fields[self.index].margin, rows, columns)
        cell_tones(labels, first, nodes, self._readings, words, scratch, cells)
        return kernels.Tone(cells, *first)

    @cached_property
    def _readings(self) -> Readings:
        chart, painted = self.quilt.charts[self.index], self.painted
        placed = self.quilt.on_chart(self.index)
        centres, own = _levels_read(self.quilt, self.index, painted, self.pyramid.levels - 1)
        image: NDArray[np.int64] | int = 0
        if self.which is not None:
            image = self.which[self.quilt.first_on(self.index) : self.quilt.first_on(self.index + 1)]
        where, source = (
            np.stack([placed[a], placed[b]], axis=1).astype(np.int64)
            for a, b in (("row", "column"), ("source_row", "source_column"))
        )
        levels = own + image * self.pyramid.levels
        turns, same = SYMMETRIES[placed["symmetry"]], SYMMETRIES[0]
        copies = (centres == UNIT * same).all(axis=1) & (turns == same).all(axis=1)
        copies &= ((where - source) % 16 == 8).all(axis=1)
        copies &= painted.height * painted.width == chart.height * chart.width
        copies &= (self.quilt.fields[self.index].matrices == UNIT * same).all()
        return Readings(where, source, centres, turns, levels, own >> 1, copies)


def texel_places(steps: int, texels: int) -> NDArray[np.int64]:
    """Return the places of this many texels along a side of this many steps, in 1/16 step, int64."""
    found: NDArray[np.int64] = (2 * np.arange(texels, dtype=np.int64) + 1) * 8 * steps // texels
    return found


def _layer(layer: LabelMap, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> kernels.Layer:
    size = 16 * layer.cell
    places = []
    for at in (rows, columns):
        moved = at + size - (0 if layer.half else size // 2)
        places.append(kernels.Places(at.astype(np.int32), moved // size, moved % size // layer.cell))
    return kernels.Layer(layer.labels, *places)


def _gathered(pieces: list[tuple[int, Callable[[], object]]]) -> list[Callable[[], object]]:
    # Combines pieces of work, with their texels, into tasks: many small charts form one, because starting a
    # task takes time.
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
