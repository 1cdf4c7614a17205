"""The perspective of a photographed wall: its lines in either direction meet in a vanishing point.

Lines through the right point differ from each other: those in joints are dark, those in tiles are light.
Lines through a wrong point cross both, and are all alike. So the search maximizes their difference.
"""

import numpy as np

from upholster.base.types import FloatArray, PixelArray
from upholster.image.photo._perspective_kernels import pencil_contrast
from upholster.image.photo.rectify import Corners

__all__ = ["proposed_corners"]

_SURE = 4.0
"""Lines through the best point must differ this many times as much as through the median point."""

_SIZES = (200, 400)
"""The photo's longer side in pixels: for the search, and for refining the point."""

_STEPS = np.linspace(-1, 1, 5)

_FACING = (np.radians(1.0), 0.03)
"""A photo that is turned and converges by less than this is seen from the front."""

_MARGIN = 0.98
"""Share of the photo that proposed corners stay inside."""


def proposed_corners(photo: PixelArray) -> Corners | None:
    """Return four corners of a large rectangle on a wall that was photographed at an angle.

    Parameters
    ----------
    photo
        (H, W, C): uint8, uint16 or float32.

    Returns
    -------
    Corners or None
        In pixels of the photo, as `upholster.image.photo.rectify.Rectification` takes them. None where lines
        are not clearly visible in two directions, or where the wall is already seen from the front.
    """
    height, width = photo.shape[:2]
    if min(height, width) < _SIZES[0] // 2:
        return None
    brightness = _brightness(photo)
    rows = _vanishing_point(brightness, 0)
    columns = None if rows is None else _vanishing_point(brightness, 1)
    if rows is None or columns is None:
        return None
    turned = max(abs(rows[1]), abs(columns[0]))
    # Parallel lines that do not meet at right angles belong to the pattern, such as hexagons.
    slanted = abs(rows[:2] @ columns[:2]) > np.sin(3 * _FACING[0])
    parallel = max(abs(rows[2]), abs(columns[2])) < _FACING[1]
    if parallel and (slanted or turned < np.sin(_FACING[0])):
        return None
    wall = np.stack([rows, columns, [0.0, 0.0, 1.0]], axis=1)  # from the wall, with (0, 0) mid-photo
    half = np.array([width, height]) / max(width, height)
    corners = _largest_rectangle(wall, half)
    if corners is None:
        return None
    first, second, third, fourth = (corners * max(width, height) / 2 + np.array([width, height]) / 2).tolist()
    return tuple(first), tuple(second), tuple(third), tuple(fourth)


def _brightness(photo: PixelArray) -> FloatArray:
    """Return perceived brightness of a photo (H, W, C), at the larger of the two sizes."""
    colours = photo[..., : min(3, photo.shape[2])].mean(axis=2, dtype=np.float64)
    found = _reduced(colours, _SIZES[1])
    if photo.dtype.kind == "f":  # linear
        return np.asarray(np.sqrt(np.maximum(np.nan_to_num(found), 0.0)))
    return found


def _reduced(plane: FloatArray, longer: int) -> FloatArray:
    by = max(1, round(max(plane.shape) / longer))
    height, width = plane.shape[0] // by, plane.shape[1] // by
    cells = plane[: height * by, : width * by].reshape(height, by, width, by)
    found: FloatArray = cells.mean(axis=(1, 3))
    return found


def _vanishing_point(brightness: FloatArray, axis: int) -> FloatArray | None:
    """Return (x, y, w) of the point where rows (axis 0) or columns (1) meet; None if it is uncertain."""
    angles, convergences = np.radians(np.arange(-32, 32.1, 1.6)), np.linspace(-0.7, 0.7, 21)
    step = np.array([angles[1] - angles[0], convergences[1] - convergences[0]])
    scores = _scores(_reduced(brightness, _SIZES[0]), axis, angles, convergences)
    if not scores.any() or scores.max() < _SURE * np.median(scores[scores > 0]):
        return None
    angle, convergence = _best(scores, angles, convergences)
    for _ in range(4):
        angles, convergences = angle + step[0] * _STEPS, convergence + step[1] * _STEPS
        angle, convergence = _best(_scores(brightness, axis, angles, convergences), angles, convergences)
        step /= 2.5
    found: FloatArray = _pencils(np.array([angle]), np.array([convergence]), axis)[0]
    return found


def _best(scores: FloatArray, angles: FloatArray, convergences: FloatArray) -> tuple[float, float]:
    n, m = np.unravel_index(scores.argmax(), scores.shape)
    return float(angles[n]), float(convergences[m])


def _pencils(angles: FloatArray, convergences: FloatArray, axis: int) -> FloatArray:
    """Return vanishing points (A · C, 3) of lines turned by the angles and converging."""
    angle, weight = (
        grid.ravel() for grid in np.meshgrid(angles + axis * np.pi / 2, convergences, indexing="ij")
    )
    return np.stack([np.cos(angle), np.sin(angle), weight], axis=1)


def _scores(brightness: FloatArray, axis: int, angles: FloatArray, convergences: FloatArray) -> FloatArray:
    """Return how far lines differ for each pair of an angle and a convergence, (A, C)."""
    height, width = brightness.shape
    edges = np.abs(np.gradient(_smoothed(brightness, 1), axis=axis))
    planes = np.stack([_even(each)[4:-4, 4:-4].ravel() for each in (brightness, edges)]).astype(np.float32)
    y, x = np.mgrid[4 : height - 4, 4 : width - 4]
    middle, half = np.array([width, height]) / 2, max(width, height) / 2
    places = (np.stack([x.ravel(), y.ravel()], axis=1) + 0.5 - middle) / half
    pencils = _pencils(angles, convergences, axis)
    lines, out = max(width, height), np.empty(len(pencils))
    room = np.empty((len(planes), lines)), np.empty(lines, np.int32)
    pencil_contrast(planes, places, pencils, *room, out)
    return out.reshape(len(angles), len(convergences))


def _even(plane: FloatArray) -> FloatArray:
    """Return a plane with mean 0 and variance 1 everywhere."""
    level = plane - _smoothed(plane, 12)
    found: FloatArray = level / np.sqrt(_smoothed(level**2, 24) + 1e-9 * (np.ptp(plane) + 1e-6) ** 2)
    return found


def _smoothed(plane: FloatArray, radius: int) -> FloatArray:
    """Return the mean of each pixel's square of 2 · radius + 1 pixels."""
    for axis in (0, 1):
        around = [(radius + 1, radius) if one == axis else (0, 0) for one in (0, 1)]
        sums = np.moveaxis(np.cumsum(np.pad(plane, around, mode="edge"), axis=axis), axis, 0)
        plane = np.moveaxis(sums[2 * radius + 1 :] - sums[: -2 * radius - 1], 0, axis) / (2 * radius + 1)
    return plane


def _largest_rectangle(wall: FloatArray, half: FloatArray) -> FloatArray | None:
    """Return the corners in the photo (4, 2) of the wall's upright rectangle that fills most of the photo.

    Parameters
    ----------
    wall
        (3, 3): from points on the wall to points in the photo, homogeneous.
    half
        Half the photo's width and height.
    """
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    seen = np.append(_MARGIN * half * signs, np.ones((4, 1)), axis=1) @ np.linalg.inv(wall).T
    if seen[:, 2].min() < 0.15:  # the horizon is near
        return None
    outline = seen[:, :2] / seen[:, 2:]
    x = np.linspace(outline[:, 0].min(), outline[:, 0].max(), 64)
    low, high = _extent(outline, x)
    left, right = np.triu_indices(len(x), 1)
    top, bottom = np.maximum(low[left], low[right]), np.minimum(high[left], high[right])
    xs, ys = np.stack([x[left], x[right], x[right], x[left]]), np.stack([top, top, bottom, bottom])
    corners = np.einsum("ij,jkn->ikn", wall, np.stack([xs, ys, np.ones_like(xs)]))
    corners = corners[:2] / corners[2]
    across, down = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    areas = np.where(bottom > top, np.abs(across[0] * down[1] - across[1] * down[0]), 0.0)
    found: FloatArray = corners[:, :, areas.argmax()].T
    return found


def _extent(outline: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest y of a convex outline (4, 2) at each x."""
    low, high = np.full(len(x), np.inf), np.full(len(x), -np.inf)
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if start[0] == end[0]:
            continue
        share = (x - start[0]) / (end[0] - start[0])
        y = start[1] + share * (end[1] - start[1])
        on = (share >= 0) & (share <= 1)
        low, high = np.where(on, np.minimum(low, y), low), np.where(on, np.maximum(high, y), high)
    return low, high
