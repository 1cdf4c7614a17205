"""Rectifying a photo: a rectangle on a wall, seen at an angle, becomes an upright sample.

A projective map, determined by four corners, relates the photo to the rectangle.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.image.photo._rectify_kernels import project_bicubic
from upholster.image.resize import premultiplied, resampled_rows
from upholster.runtime.parallel import run_tasks

__all__ = ["Corners", "Rectification"]

Corners = tuple[tuple[float, float], tuple[float, float], tuple[float, float], tuple[float, float]]
"""(x, y) of top left, top right, bottom right, bottom left."""

_FOCAL = 0.72
"""Focal length over the photo's longer side, if the corners do not give it: phones have 0.67 to 0.78."""

_FOCAL_LEAST, _FOCAL_MOST = 0.5, 3.0
_STEEPEST = 6.0
"""The most pixels of the photo, along a side, that may be reduced to one in the result."""

_CLEAN = 1.1
"""Reductions up to this factor need no filter before sampling."""

_TILE = 512


class Rectification:
    """The map from a rectangle to a photo, and the size of the rectangle's image.

    Parameters
    ----------
    corners
        In pixels of the upright photo, (0, 0) its top left corner and (width, height) its bottom right one.
        The first becomes the result's top left corner, the others follow clockwise.
    width, height
        Size of the photo.

    Attributes
    ----------
    matrix
        (3, 3): from (x, y, 1) in pixels of the result to (x·w, y·w, w) in pixels of the photo.
    width, height
        Size of the result: as many pixels as a rectangle of the corners' mean side lengths has. Its aspect
        ratio is that of the rectangle on the wall, seen by a camera whose axis goes through the photo's
        middle (Zhang and He, section 4). If the photo is tilted about both axes, the corners give the
        camera's focal length. Otherwise a phone's is assumed, 0.72 of the longer side. Seen from the front
        it does not matter.

    Raises
    ------
    InputError
        If a corner is not finite or outside the photo, if the corners are not a convex quadrilateral or run
        counterclockwise, or if they are seen so steeply that six pixels at the near end make one of the
        result.

    References
    ----------
    Z. Zhang, L.-W. He: Whiteboard scanning and image enhancement. Digital Signal Processing 17, 2007.
    P. Heckbert: Fundamentals of texture mapping and image warping. Berkeley 1989, section 2.2.3.
    """

    def __init__(self, corners: Corners, width: int, height: int) -> None:
        points = _checked(corners, width, height)
        sides = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        wide, tall = (sides[0] + sides[2]) / 2, (sides[1] + sides[3]) / 2
        ratio = _true_ratio(points, width, height)
        self.width = max(1, round(float(np.sqrt(wide * tall * ratio))))
        self.height = max(1, round(float(np.sqrt(wide * tall / ratio))))
        self.matrix = _square_to(points) @ np.diag([1 / self.width, 1 / self.height, 1.0])
        self._steps = self._longest_steps()
        if max(self._steps) > _STEEPEST:
            raise InputError(
                f"rectify's corners are seen too steeply: {max(self._steps):.0f} pixels at the near end make "
                f"one of the result; allowed: up to {_STEEPEST:.0f}"
            )

    def apply(self, pixels: PixelArray) -> NDArray[np.float32]:
        """Return the rectangle of a photo.

        It is sampled by cubic interpolation, densely enough that no pixel of the photo is skipped, and
        reduced by the filter of `upholster.image.resize`, so nothing aliases.

        Parameters
        ----------
        pixels
            (H, W, C) of the photo's size; uint8 and uint16 sRGB-coded, floats linear. Alpha weights colours.

        Returns
        -------
        ndarray
            (height, width, C) float32, linear light; alpha is not premultiplied.
        """
        across, down = (1.0 if step <= _CLEAN else step for step in self._steps)
        wide, tall = int(np.ceil(self.width * across)), int(np.ceil(self.height * down))
        finer = self.matrix @ np.diag([self.width / wide, self.height / tall, 1.0])
        size = (tall, wide, pixels.shape[2])
        result = resampled_rows(
            lambda low, high: _projected(pixels, finer, low, high, wide),
            size,
            height=self.height,
            width=self.width,
        )
        # Cubic interpolation overshoots at edges, and light is never negative.
        if pixels.dtype.kind != "f" or pixels.min() >= 0:
            np.maximum(result, 0.0, out=result)
        return result

    def derivative(self) -> FloatArray:
        """Return (height, width, 2, 2): the photo's (x, y) by the result's, at each pixel of the result."""
        x, y = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        return self._derivative_at(np.stack([x, y], axis=-1))

    def _derivative_at(self, places: FloatArray) -> FloatArray:
        projected = places @ self.matrix[:, :2].T + self.matrix[:, 2]
        depth = projected[..., 2, None, None]
        found = projected[..., :2, None] / depth
        derivative: FloatArray = (self.matrix[:2, :2] - found * self.matrix[2, :2]) / depth
        return derivative

    def _longest_steps(self) -> tuple[float, float]:
        """Return the longest distance in the photo that a pixel of the result spans, right and down."""
        x, y = np.meshgrid(np.linspace(0, self.width, 17), np.linspace(0, self.height, 17))
        lengths = np.linalg.norm(self._derivative_at(np.stack([x, y], axis=-1)), axis=-2)
        return float(lengths[..., 0].max()), float(lengths[..., 1].max())


def _checked(corners: Corners, width: int, height: int) -> FloatArray:
    allowed = "allowed: x,y of top left, top right, bottom right, bottom left"
    try:
        points = np.array(corners, np.float64)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.shape != (4, 2):
        raise InputError(f"rectify is {corners!r}; {allowed}")
    for x, y in points.tolist():
        if not (0 <= x <= width and 0 <= y <= height):  # false for NaN as well
            raise InputError(f"rectify has the corner {x:g},{y:g}; allowed: inside {width}x{height}")
    ahead, behind = np.roll(points, -1, axis=0) - points, points - np.roll(points, 1, axis=0)
    turns = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    shown = " ".join(f"{x:g},{y:g}" for x, y in points.tolist())
    if (turns < 0).all():
        raise InputError(f"rectify is {shown}, which runs counterclockwise; {allowed}")
    # A corner of 180 degrees is not a corner; an area below a thousandth of the longest side squared is one.
    if turns.min() <= 1e-3 * float((ahead**2).sum(axis=1).max()):
        raise InputError(f"rectify is {shown}, no convex quadrilateral; {allowed}")
    return points


def _square_to(points: FloatArray) -> FloatArray:
    """Return the map from the unit square to a quadrilateral (Heckbert, section 2.2.3)."""
    first, second, third, fourth = points
    rest = first - second + third - fourth
    g, h = np.linalg.solve(np.stack([second - third, fourth - third], axis=1), rest)
    matrix = np.ones((3, 3))
    matrix[:2, 0] = second - first + g * second
    matrix[:2, 1] = fourth - first + h * fourth
    matrix[:2, 2] = first
    matrix[2, :2] = g, h
    return matrix


def _true_ratio(points: FloatArray, width: int, height: int) -> float:
    """Return width over height of the rectangle that a centred camera sees like this (Zhang, He: 11–20)."""
    longer = max(width, height)
    centred = (points - np.array([width, height]) / 2) / longer
    matrix = _square_to(centred)
    # The columns are the rectangle's sides in space, seen by the camera diag(f, f, 1): at right angles.
    right, down = matrix[:, 0], matrix[:, 1]
    squared = _FOCAL**2
    both = right[2] * down[2]
    if both != 0:
        found = -(right[0] * down[0] + right[1] * down[1]) / both
        if _FOCAL_LEAST**2 <= found <= _FOCAL_MOST**2:
            squared = found
    lengths = [np.sqrt((side[0] ** 2 + side[1] ** 2) / squared + side[2] ** 2) for side in (right, down)]
    return float(lengths[0] / lengths[1])


def _projected(
    pixels: PixelArray, matrix: FloatArray, low: int, high: int, width: int
) -> NDArray[np.float32]:
    """Return rows `low` to `high` of the map's result, linear and premultiplied, tile by tile."""
    band = np.empty((high - low, width, pixels.shape[2]), np.float32)

    def fill(top: int, left: int) -> None:
        tile = np.empty_like(band[top : top + _TILE, left : left + _TILE], order="C")
        bottom, right = top + tile.shape[0], left + tile.shape[1]
        edges = np.array([[x, y + low, 1.0] for x in (left, right) for y in (top, bottom)]) @ matrix.T
        reach = edges[:, :2] / edges[:, 2:]
        # Two samples on each side for the cubic; straight lines stay straight, so corners bound the tile.
        x0, y0 = np.maximum(np.floor(reach.min(axis=0)).astype(int) - 3, 0)
        x1, y1 = np.ceil(reach.max(axis=0)).astype(int) + 3
        origin = np.array([y0, x0], np.int32)
        start = np.array([low + top, left], np.int32)
        source = np.ascontiguousarray(premultiplied(pixels[y0:y1, x0:x1]))
        project_bicubic(source, origin, matrix, start, tile)
        band[top:bottom, left:right] = tile

    places = [(top, left) for top in range(0, high - low, _TILE) for left in range(0, width, _TILE)]
    run_tasks([partial(fill, *place) for place in places])
    return band
