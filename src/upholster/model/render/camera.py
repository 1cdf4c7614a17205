"""The viewpoint of a picture: a perspective camera, and its placement in front of a model."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, frozen_array

__all__ = ["FIELD_OF_VIEW", "FILL", "Camera"]

FIELD_OF_VIEW = 30.0
"""Vertical angle of view in degrees, at zoom 1."""

FILL = 0.875
"""Share of the picture's height or width, whichever is more restrictive, that the model fills at zoom 1."""

MAX_SIDE = 16384
ZOOMS = (0.1, 200.0)


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A perspective camera; z is up.

    Attributes
    ----------
    eye
        (3,) float64, read-only: its position, in model units.
    axes
        (3, 3) float64, read-only: the unit vectors right, up and forward, as rows.
    focal
        Focal length in pixels: an object of size 1 at depth 1 is `focal` pixels large.
    size
        (width, height) of the picture in pixels. Its centre is the point straight ahead.
    """

    eye: FloatArray
    axes: FloatArray
    focal: float
    size: tuple[int, int]

    @classmethod
    def fit(
        cls,
        points: ArrayLike,
        *,
        size: tuple[int, int] = (1024, 768),
        view: tuple[float, float] = (30.0, 30.0),
        zoom: float = 1.0,
        target: ArrayLike | None = None,
    ) -> "Camera":
        """Place the camera so that `points` just fit: centred, `FILL` of the height or of the width.

        Parameters
        ----------
        points
            (V, 3): the points to fit into the picture, in model units.
        size
            (width, height) in pixels, 1 to 16384 each.
        view
            (azimuth, elevation) in degrees. Azimuth 0 looks from -y toward +y with x to the right; positive
            azimuth moves counter-clockwise around the model seen from above. Elevation, -90 to 90, is the
            camera's angle above the horizon; at 90, azimuth 0, y points up in the picture.
        zoom
            0.1 to 200: narrows the angle of view; the camera stays where it is, so it never enters the model.
        target
            (3,): the point to put in the middle of the picture instead of the model's middle. The camera
            moves sideways and keeps its direction.

        Raises
        ------
        InputError
            An argument is out of range, not finite or of the wrong shape, or the points are all the same.

        Notes
        -----
        The points p fit between the two side planes of slope k = FILL·tan(half angle) exactly when
        ``max(x + k·z) ≤ cx + k·cz`` and ``max(-x + k·z) ≤ -cx + k·cz`` in the camera's axes (z backward), and
        likewise for y. So the camera's position has a closed form, without a search.
        """
        width, height = checked_size(size)
        azimuth, elevation = _checked_view(view)
        if not (isinstance(zoom, (int, float)) and ZOOMS[0] <= zoom <= ZOOMS[1]):
            raise InputError(f"zoom is {zoom}; allowed: {ZOOMS[0]:g} to {ZOOMS[1]:g}")
        cloud = np.asarray(points, dtype=np.float64)
        if cloud.ndim != 2 or cloud.shape[1] != 3 or len(cloud) == 0:
            raise InputError(f"points has shape {cloud.shape}; allowed: (V, 3) with V at least 1")
        if not np.isfinite(cloud).all():
            raise InputError("points holds values that are not finite; allowed: finite coordinates")
        lowest, highest = cloud.min(axis=0), cloud.max(axis=0)
        extent = float(np.max(highest - lowest))
        if not 0 < extent < math.inf:
            raise InputError(f"points span {extent:g} units; allowed: more than one place, finite")

        axes = _axes(azimuth, elevation)
        middle = lowest + (highest - lowest) / 2
        # Lengths relative to the extent: no overflow, whatever the model's units.
        across, above, ahead = axes @ ((cloud - middle) / extent).T
        slope = math.tan(math.radians(FIELD_OF_VIEW) / 2)
        place = [0.0, 0.0]
        distance = 0.0
        for axis, (offset, k) in enumerate(((across, FILL * slope * width / height), (above, FILL * slope))):
            high, low = float(np.max(offset - k * ahead)), float(np.max(-offset - k * ahead))
            place[axis] = (high - low) / 2
            distance = max(distance, (high + low) / (2 * k))
        # For a model seen edge-on (a flat sheet from the side) this still keeps the camera outside it.
        distance = max(distance, 0.05 - float(np.min(ahead)))
        if target is not None:
            aim = np.asarray(target, dtype=np.float64)
            if aim.shape != (3,) or not np.isfinite(aim).all():
                raise InputError(f"target is {target}; allowed: three finite coordinates")
            place = [float(x) for x in axes[:2] @ ((aim - middle) / extent)]
        eye = middle + extent * (np.array([place[0], place[1], -distance]) @ axes)
        return cls(frozen_array(eye), frozen_array(axes), zoom * height / (2 * slope), (width, height))

    def project(self, points: ArrayLike) -> FloatArray:
        """Return where points appear: (..., 3) float64 of pixel x, pixel y and depth, for (..., 3) points.

        Pixel (column c, row r) covers x from c to c + 1 and y from r to r + 1, y downward. Depth is measured
        along the viewing direction in model units, as in the depth that `render` returns; points at or behind
        the eye (depth ≤ 0) have x and y NaN.
        """
        space = np.asarray(points, dtype=np.float64)
        if space.ndim < 1 or space.shape[-1] != 3:
            raise InputError(f"points has shape {space.shape}; allowed: (..., 3)")
        result = np.asarray((space - self.eye) @ self.axes.T)
        depth = result[..., 2]
        scale = np.divide(self.focal, depth, out=np.full_like(depth, np.nan), where=depth > 0)
        result[..., 0] = self.size[0] / 2 + scale * result[..., 0]
        result[..., 1] = self.size[1] / 2 - scale * result[..., 1]
        return result

    def directions(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> FloatArray:
        """Return (..., 3) ray directions through picture points (x, y) in pixels; 1 long along forward."""
        right, up, forward = self.axes
        across = (x[..., None] - self.size[0] / 2) / self.focal
        above = (self.size[1] / 2 - y[..., None]) / self.focal
        return np.asarray(forward + across * right + above * up)


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return (width, height) as plain integers, or raise `InputError`."""
    sides = np.asarray(size)
    if sides.shape != (2,) or sides.dtype.kind not in "iu" or sides.min() < 1 or sides.max() > MAX_SIDE:
        raise InputError(f"size is {size}; allowed: (width, height), whole numbers from 1 to {MAX_SIDE}")
    return int(sides[0]), int(sides[1])


def _checked_view(view: tuple[float, float]) -> tuple[float, float]:
    angles = np.asarray(view)
    if angles.shape != (2,) or angles.dtype.kind not in "iuf" or not np.isfinite(angles).all():
        raise InputError(f"view is {view}; allowed: (azimuth, elevation), two finite angles in degrees")
    if abs(angles[1]) > 90:
        raise InputError(f"elevation is {angles[1]:g}; allowed: -90 to 90 degrees")
    return math.radians(math.fmod(float(angles[0]), 360.0)), math.radians(float(angles[1]))


def _axes(azimuth: float, elevation: float) -> FloatArray:
    """Return right, up and forward as rows. No cross product with z, because straight down is a view too."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([[ca, sa, 0.0], [-sa * se, ca * se, ce], [-sa * ce, ca * ce, -se]])
