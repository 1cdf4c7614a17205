"""The exemplar as the LL bands of a Haar transform, with which texels are compared level by level."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.codec.haar import dwt2, subbands
from upholster.runtime.parallel import run_tasks
from upholster.synthesis.pixel._pixel_kernels import (
    PARENT_REACH,
    REACH,
    ChosenTexels,
    Neighbourhood,
    PixelLevel,
    similar_pixels,
)
from upholster.synthesis.working_form import working_form

__all__ = ["NOTHING", "doubled", "exemplar_levels", "scratch"]

NOTHING = np.zeros(0, np.int32)
"""Stands for the parents' pixels if there is no coarser level."""

_PAIRS_PER_CALL = 2**22


def exemplar_levels(exemplar: PixelArray, *, levels: int, similar: int) -> list[PixelLevel]:
    """Return the data by which an exemplar's pixels are compared on each level, the finest first.

    Parameters
    ----------
    exemplar
        (H, W, C), at least 5·2^levels pixels each way; pixels beyond whole tiles of 2^levels are left out.
    levels
        Levels of the Haar transform: there are `levels` + 1 images, the exemplar and LL1 to LLn.
    similar
        Number of pixels that look alike to keep for each pixel, 0 for none. At the coarsest level they are
        the best of all, on the others the best children of those of the level above.

    References
    ----------
    Tong, Zhang, Liu, Wang, Guo, Shum: Synthesis of bidirectional texture functions on arbitrary surfaces,
    SIGGRAPH 2002: k-coherence.
    """
    images = _approximations(exemplar, levels)
    found = [_level(image, images[n + 1] if n < levels else None, similar) for n, image in enumerate(images)]
    if similar:
        among = np.zeros((0, similar + 1), np.int32)
        for level, finer in zip(reversed(found), [*reversed(found[:-1]), None], strict=True):
            _fill_similar(level, among)
            if finer is not None:
                own = np.arange(len(level.inside), dtype=np.int32)[:, None]
                among = doubled(np.concatenate([own, level.similar], axis=1), level.width)
    return found


def doubled(pixels: IntArray, width: int) -> IntArray:
    """Return for pixels of a level of `width` the first of their four on the next finer one; −1 stays."""
    first: IntArray = 4 * width * (pixels // width) + 2 * (pixels % width)
    return np.where(pixels < 0, -1, first).astype(np.int32)


def scratch(level: PixelLevel) -> Neighbourhood:
    """Return memory for choosing pixels on a level; each thread needs its own."""
    own, parent = (2 * REACH + 1) ** 2 - 1, (2 * PARENT_REACH + 1) ** 2
    terms, similar = (own + parent) * level.channels, level.similar.shape[1]
    return Neighbourhood(
        np.empty(terms, np.int64),
        np.empty(terms, np.float32),
        np.empty(9 * (1 + similar), np.int64),
        np.empty(max(level.width, similar), np.float32),
    )


def _approximations(exemplar: PixelArray, levels: int) -> list[FloatArray]:
    # LL0 (the exemplar) to LLn as means of their tiles, in whole numbers from 0 to 255.
    tile = 2**levels
    height, width = (size // tile * tile for size in exemplar.shape[:2])
    working = working_form(exemplar)[:height, :width]
    out = [working.astype(np.float64)]
    for level in range(1, levels + 1):
        low = subbands(dwt2(working, levels=level), levels=level)[f"LL{level}"]
        out.append(low / 2**level)
    return [np.floor(image / 4 + 0.5).clip(0, 255) for image in out]


def _level(image: FloatArray, coarser: FloatArray | None, similar: int) -> PixelLevel:
    height, width, channels = image.shape
    planes = np.moveaxis(image, 2, 0)
    if coarser is not None:
        above = np.moveaxis(coarser, 2, 0).repeat(2, axis=1).repeat(2, axis=2)
        planes = np.concatenate([planes, above])
    inside = np.zeros((height, width), np.uint8)
    inside[REACH : height - REACH, REACH : width - REACH] = 1
    alike = np.full((height * width, similar), -1, np.int32)
    flat = np.ascontiguousarray(planes, np.float32).reshape(-1)
    return PixelLevel(flat, inside.reshape(-1), alike, height, width, channels)


def _fill_similar(level: PixelLevel, among: IntArray) -> None:
    pixels = np.arange(level.height * level.width, dtype=np.int32)
    above = np.arange(len(among), dtype=np.int32)
    parents = doubled(above, level.width // 2) if len(among) else NOTHING
    tasks: list[Callable[[], object]] = []
    candidates = 4 * among.shape[1] if len(among) else level.inside.size
    rows = max(1, _PAIRS_PER_CALL // (candidates * level.width))
    for row in range(REACH, level.height - REACH, rows):
        end = min(row + rows, level.height - REACH)
        chart = ChosenTexels(0, level.width, 0, level.width // 2, row, end, REACH, level.width - REACH, 1, 0)
        tasks.append(partial(_fill_rows, level, pixels, parents, among, chart))
    run_tasks(tasks)


def _fill_rows(
    level: PixelLevel, pixels: IntArray, parents: IntArray, among: NDArray[np.int32], chart: ChosenTexels
) -> None:
    similar_pixels(pixels, parents, among, chart, level, scratch(level))
