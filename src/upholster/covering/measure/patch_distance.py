"""Whether larger pieces of a result occur in the sample, and pieces of the sample in the result."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.charted_surface import ChartedSurface
from upholster.covering.measure.fidelity import check_alike
from upholster.covering.measure.measure_rows import Row, figure
from upholster.covering.measure.samples import SEED, bilinear, coded
from upholster.covering.measure.trace import charted_of
from upholster.quilt.model import Quilt, Texels

__all__ = ["PATCH", "PatchDistance", "patch_distance", "undistorted_views"]

PATCH = 31
"""Side of a patch in pixels of the sample."""

PATCHES = 96
VIEWS = 12
SIDES = (96, 64, 44)
"""Sides of views, in pixels of the sample: the first that fits often enough is used."""

LARGEST = 512
"""Side of a flat result's windows."""

FEWER = 2**18
"""If more pixels than this are to be searched, fewer patches are compared."""


@dataclass(frozen=True, slots=True)
class PatchDistance:
    """Distances to the nearest patch, each a root mean square over the sample's standard deviation.

    Attributes
    ----------
    to_sample
        Mean over patches of the result, to the sample's: 0 is copied verbatim, as inside blocks. Broken
        elements match no patch of the sample.
    to_result
        Mean over patches of the sample, to the result's: it grows with parts that the result leaves out.
    """

    to_sample: float
    to_result: float

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        return [
            ("patch distance, 31²", figure(self.to_sample), "result to sample"),
            ("  the other way", figure(self.to_result), "sample to result"),
        ]


def patch_distance(
    results: Sequence[PixelArray], exemplar: PixelArray, *, side: int = PATCH
) -> PatchDistance | None:
    """Measure how far patches of 31×31 pixels, by default, are from the nearest ones on the other side.

    About 96 random patches of either side are compared with all of the other; brightness is the mean of all
    channels, sRGB-coded.

    Parameters
    ----------
    results
        One or more (h, w, C) arrays at the sample's scale and direction: flat, or `undistorted_views`.
    exemplar
        (H, W, C), of the same number of channels.
    side
        Side of a patch, 1 or more pixels.

    Returns
    -------
    PatchDistance or None
        None if either side is smaller than a patch, or nothing varies.

    Raises
    ------
    InputError
        If numbers of channels differ, an array is smaller than 7 pixels each way, or `side` is out of range.

    References
    ----------
    Simakov, Caspi, Shechtman, Irani: Summarizing visual data using bidirectional similarity, CVPR 2008,
    equation 1: completeness and coherence.
    """
    check_alike(results, exemplar)
    if side < 1:
        raise InputError(f"side is {side} pixels; allowed: 1 or more")
    ours = [_brightness(part) for part in results if min(part.shape[:2]) >= side]
    theirs = _brightness(exemplar)
    if not ours or min(theirs.shape) < side or theirs.std() < 1e-6:
        return None
    spread = float(theirs.std())
    return PatchDistance(
        _mean_distance(ours, [theirs], side) / spread,
        _mean_distance([theirs], ours, side) / spread,
    )


def undistorted_views(quilt: Quilt, texels: Texels) -> list[PixelArray]:
    """Return pieces of a result as a flat texture would have them: at the sample's scale and direction.

    Charts whose texels are the sample's pixels are used unchanged, in windows of at most 512². For others, up
    to 12 random squares are resampled through the warp field's matrix in their middle, 96² pixels of the
    sample large, or smaller where too few fit on charts: as 16 bits, sRGB-coded.
    """
    rng = np.random.default_rng(SEED)
    if all(field.is_identity for field in quilt.fields):
        return [array[:LARGEST, :LARGEST] for array in texels.arrays]
    charted = charted_of(quilt)
    areas = np.array([chart.height * chart.width for chart in quilt.charts], np.float64)
    for side in SIDES:
        found: list[PixelArray] = []
        for index in rng.choice(len(areas), 16 * VIEWS, p=areas / areas.sum()).tolist():
            view = _view(quilt, texels, charted, index, rng, side)
            if view is not None:
                found.append(view)
                if len(found) == VIEWS:
                    break
        if len(found) >= VIEWS // 3:
            return found
    return found


def _view(
    quilt: Quilt,
    texels: Texels,
    charted: ChartedSurface | None,
    index: int,
    rng: np.random.Generator,
    side: int,
) -> PixelArray | None:
    # A square around a random texel of a chart, as the sample has it; None if it leaves the chart.
    chart = quilt.charts[index]
    middle = rng.uniform(0, (chart.height, chart.width))
    matrix = quilt.fields[index].at(middle[:1], middle[1:])[0]
    steps = np.arange(side) - (side - 1) / 2
    offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    places = middle + offsets @ np.linalg.inv(matrix).T
    if (places < 0).any() or (places > (chart.height - 1, chart.width - 1)).any():
        return None
    row, column = (int(part) for part in middle)
    if charted is not None and not charted.lies_on(index, (row, column), (1, 1)).all():
        return None
    view = bilinear(texels.arrays[index], places[:, 0], places[:, 1]).reshape(side, side, -1)
    return np.rint(65535 * np.clip(view, 0, 1)).astype(np.uint16)


def _brightness(pixels: PixelArray) -> FloatArray:
    mean: FloatArray = coded(pixels).mean(axis=2, dtype=np.float64)
    return mean


def _mean_distance(sides: Sequence[FloatArray], others: Sequence[FloatArray], patch: int) -> float:
    rng = np.random.default_rng(SEED)
    searched = sum(part.size for part in others)
    count = max(16, int(PATCHES * min(1.0, FEWER / searched)))
    weights = np.array(
        [(part.shape[0] - patch + 1) * (part.shape[1] - patch + 1) for part in sides], np.float64
    )
    spectra = [np.fft.rfft2(part) for part in others]
    squares = [_sums(part * part, patch) for part in others]
    total = 0.0
    for index in rng.choice(len(sides), count, p=weights / weights.sum()).tolist():
        part = sides[index]
        row, column = (int(rng.integers(size - patch + 1)) for size in part.shape)
        cut = part[row : row + patch, column : column + patch]
        best = np.inf
        for other, spectrum, square in zip(others, spectra, squares, strict=True):
            product = np.fft.irfft2(spectrum * np.fft.rfft2(cut, other.shape).conj(), other.shape)
            inner = product[: square.shape[0], : square.shape[1]]
            best = min(best, float((square - 2 * inner).min()))
        total += np.sqrt(max(0.0, best + float((cut * cut).sum())) / patch**2)
    return float(total / count)


def _sums(values: FloatArray, patch: int) -> FloatArray:
    # For all patches.
    sums = np.pad(values.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    found: FloatArray = (
        sums[patch:, patch:] - sums[patch:, :-patch] - sums[:-patch, patch:] + sums[:-patch, :-patch]
    )
    return found
