"""The joints of a sample: thin lines between its elements, and each pixel's distance from them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray, frozen_array
from upholster.image.elements._joint_kernels import (
    filter_plane,
    measure_distances,
    measure_ridges,
    thin_ridges,
    trace_joints,
)
from upholster.image.elements.planes import reduced
from upholster.runtime.stages import stage

__all__ = ["Joints", "find_joints"]

_LOOKED_AT = 192
"""The shorter side is examined at this many pixels, up to twice as many: larger samples are reduced."""

_LEAST_SIDE = 32

_WIDTHS = (1.5, 2.5)
"""Standard deviations, in pixels, of the Gaussians that are used to find joints of different widths."""

_UNIT = 256
"""Scale of taps, which are whole numbers."""

_USUAL, _WEAK, _STRONG = 0.97, 0.25, 0.6
"""97 % of pixels are below a usual strength. A line is everywhere above the second share of it, and somewhere
above the third."""

_LONG = 10
"""Length of a joint at least, in widths."""

_FAR = 0.9
"""Share of all pixels, those nearest to a joint, whose distances are distinguished."""

_ON = 40
"""A pixel with a smaller distance is on a joint."""

_SURE = 4.5
"""Least certainty of joints."""


@dataclass(frozen=True, eq=False)
class Joints:
    """The joints of a sample.

    Attributes
    ----------
    distances
        (H, W) uint8: each pixel's distance from the nearest joint, 0 to 255. A tenth of all pixels have 255.
    certainty
        How much stronger joints are than other lines, times the share of lines that are long: 4.5 or more.
    across
        How many joints a line through the sample crosses on average, down or across, whichever are more: the
        number of elements in a row.
    """

    distances: NDArray[np.uint8]
    certainty: float
    across: float

    def __post_init__(self) -> None:
        frozen_array(self.distances)


@stage
def find_joints(exemplar: PixelArray) -> Joints | None:
    """Find thin long lines, dark or light, that separate a sample's elements: stones, boards, tiles.

    Lines are the crests of the larger eigenvalue of the brightness's Hessian, at two widths, dark and light
    ones separately. The kind and width whose lines are longest and stand out most are taken.

    Parameters
    ----------
    exemplar
        (H, W, C), any number of channels; uint8, uint16 or float32.

    Returns
    -------
    Joints or None
        None if there are no certain ones.

    References
    ----------
    Steger: An unbiased detector of curvilinear structures, PAMI 20 (1998), on lines by the Hessian.
    """
    height, width = exemplar.shape[:2]
    if min(height, width) < _LEAST_SIDE:
        return None
    by = max(1, min(height, width) // _LOOKED_AT)
    plane = reduced(exemplar, by)[..., :3].sum(axis=2).astype(np.float64)
    found = []
    for deviation in _WIDTHS:
        derivatives = _derivatives(plane, deviation)
        found += [_lines(derivatives, sign, deviation) for sign in (1.0, -1.0)]
    certainty, distances = max(found, key=lambda one: one[0])
    if certainty < _SURE:
        return None
    far = max(3.0, _below(distances, _FAR))
    near = np.minimum(np.rint(distances * (255 / far)), 255).astype(np.uint8)
    rows = np.minimum(np.arange(height) // by, near.shape[0] - 1)
    columns = np.minimum(np.arange(width) // by, near.shape[1] - 1)
    return Joints(near[rows[:, None], columns], certainty, _crossed(near < _ON))


def _crossed(on: NDArray[np.bool_]) -> float:
    # How many joints rows or columns cross on average.
    down, right = (np.diff(on, axis=axis).sum() / 2 / on.shape[1 - axis] for axis in (0, 1))
    return round(float(max(down, right)), 3)


def _below(values: NDArray[Any], share: float) -> float:
    # The value that a share of all values is below.
    n = int(share * values.size)
    return float(np.partition(values.reshape(-1), n)[n])


def _derivatives(plane: FloatArray, deviation: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Second derivatives of a plane under a Gaussian: down the rows, along them, and mixed.
    reach = int(4 * deviation + 0.5)
    places = np.arange(-reach, reach + 1) / deviation
    even = _UNIT * np.exp(-0.5 * places**2)
    smooth, once, twice = np.rint(even), np.rint(places * even), np.rint((places**2 - 1) * even)
    twice -= np.rint(twice.sum() / len(twice))
    scratch, upright, level, mixed = (np.empty_like(plane) for _ in range(4))
    filter_plane(plane, twice, smooth, scratch, upright)
    filter_plane(plane, smooth, twice, scratch, level)
    filter_plane(plane, once, once, scratch, mixed)
    return upright, level, mixed


def _lines(
    derivatives: tuple[FloatArray, FloatArray, FloatArray], sign: float, deviation: float
) -> tuple[float, NDArray[np.int32]]:
    # How certain lines of one kind are, and each pixel's distance from the nearest.
    shape = derivatives[0].shape
    ridges, across, thin = np.empty(shape), np.empty(shape, np.int8), np.empty(shape, np.uint8)
    measure_ridges(*derivatives, sign, ridges, across)
    usual = _below(ridges, _USUAL)
    thin_ridges(ridges, across, _WEAK * usual, thin)
    trace_joints(ridges, thin, _STRONG * usual, int(_LONG * deviation), np.empty(ridges.size, np.int32))
    distances = np.empty(shape, np.int32)
    measure_distances((thin == 2).astype(np.uint8), distances)
    beyond = distances > 7.5 * deviation
    if not (thin == 2).any() or not beyond.any():
        return 0.0, distances
    share = ridges[thin == 2].sum() / ridges[thin > 0].sum()
    contrast = ridges[thin == 2].mean() / max(float(ridges[beyond].mean()), 1e-9)
    return round(float(share * contrast), 3), distances
