"""The inputs of a picture, checked before work starts."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.model.render.texture import MAX_LEVEL

__all__ = ["Color", "check_numbers", "checked_background", "checked_model"]

Color = tuple[float, float, float]


def checked_model(
    positions: ArrayLike, normals: ArrayLike, uv: ArrayLike, triangles: ArrayLike
) -> tuple[FloatArray, NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Return the model's arrays, or raise `InputError`."""
    place = _checked_vertices("positions", positions, 3, None)
    normal = _checked_vertices("normals", normals, 3, len(place))
    coordinates = _checked_vertices("uv", uv, 2, len(place))
    corners = np.asarray(triangles)
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) == 0 or corners.dtype.kind not in "iu":
        raise InputError(
            f"triangles is {corners.dtype} of shape {corners.shape}; allowed: integers of shape (N, 3), N ≥ 1"
        )
    if corners.min() < 0 or corners.max() >= len(place):
        bad = corners.min() if corners.min() < 0 else corners.max()
        raise InputError(f"triangles holds vertex {bad}; allowed: 0 to {len(place) - 1}")
    used = place[corners.reshape(-1)]
    if not (used.max(axis=0) > used.min(axis=0)).any():
        raise InputError("positions has all triangles in one point; allowed: a model of some size")
    # Copies of one layout: otherwise kernels would be recompiled for arrays that are read-only or ordered
    # differently.
    return (
        np.array(place, np.float64, order="C"),
        np.array(normal, np.float32, order="C"),
        np.array(coordinates, np.float32, order="C"),
        np.array(corners, np.int32, order="C"),
    )


def _checked_vertices(name: str, values: ArrayLike, columns: int, count: int | None) -> NDArray[Any]:
    array = np.asarray(values)
    rows = "V" if count is None else str(count)
    if (
        array.ndim != 2
        or array.shape[1] != columns
        or array.dtype.kind not in "iuf"
        or count not in (None, len(array))
    ):
        raise InputError(
            f"{name} is {array.dtype} of shape {array.shape}; allowed: numbers of shape ({rows}, {columns})"
        )
    if not np.isfinite(array).all():
        raise InputError(f"{name} holds values that are not finite; allowed: finite numbers")
    return array


def check_numbers(
    supersample: int, max_level: int, depth: NDArray[np.float32] | None, shape: tuple[int, int]
) -> None:
    """Raise `InputError` unless these are valid for `render`; the picture has this (height, width)."""
    if not isinstance(supersample, (int, np.integer)) or not 1 <= supersample <= 8:
        raise InputError(f"supersample is {supersample}; allowed: 1 to 8")
    if not isinstance(max_level, (int, np.integer)) or not 0 <= max_level <= MAX_LEVEL:
        raise InputError(f"max_level is {max_level}; allowed: 0 to {MAX_LEVEL}")
    if depth is not None and (depth.shape != shape or depth.dtype != np.float32):
        raise InputError(f"depth is {depth.dtype} of shape {depth.shape}; allowed: float32 of shape {shape}")


def checked_background(background: Color | tuple[Color, Color] | None, height: int) -> NDArray[np.float32]:
    """Return one colour per row of the picture, (height, 3), or (0, 3) for none."""
    if background is None:
        return np.empty((0, 3), np.float32)
    colors = np.asarray(background, dtype=np.float64)
    if colors.shape not in ((3,), (2, 3)) or not (np.isfinite(colors).all() and colors.min() >= 0):
        raise InputError(
            f"background is {background}; allowed: a linear colour (r, g, b), two of them, or None"
        )
    top, bottom = np.broadcast_to(colors, (2, 3))
    share = (np.arange(height)[:, None] + 0.5) / height
    return np.asarray(top + share * (bottom - top), np.float32)
