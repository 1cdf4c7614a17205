"""Unit normals, also where the derivatives do not span a plane: at a pole, an apex, a collapsed edge."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray

__all__ = ["derivative_bounds", "unit_normals"]

Frames = Callable[[FloatArray, FloatArray], FloatArray]
"""``frames(s, t)``: maps (N,) parameters to (N, 3, 3) points and derivatives."""

FLAT = 1e-5
"""Below this sine-like ratio the cross product has lost so many digits that extrapolation is better."""

LOST = 1e-10
"""Below this ratio it holds nothing but rounding errors."""

STEPS = 2.0 ** -np.arange(5.0, 12.0)
"""Distances in parameter at which the limit is sampled: 1/32 down to 1/2048."""


def derivative_bounds(net: FloatArray) -> tuple[float, float]:
    """Return the order of magnitude of a patch's largest derivatives by s and by t, in units of length."""
    points = net[..., :3] / net[..., 3:]
    m, n = net.shape[0] - 1, net.shape[1] - 1
    along_s = float(np.abs(np.diff(points, axis=0)).max())
    along_t = float(np.abs(np.diff(points, axis=1)).max())
    return m * along_s, n * along_t


def unit_normals(
    values: FloatArray, s: FloatArray, t: FloatArray, net: FloatArray, frames: Frames
) -> FloatArray:
    """Return the unit normals S_s × S_t; where that vanishes, the limit along the patch.

    The limit is taken inward along the parameter that leaves the collapsed edge, at steps h, h/2, h/4, …, and
    extrapolated to 0 by Neville's scheme: accurate to about 1e-11 where the patch is smooth. A patch without
    any area gets (0, 0, 1).

    Parameters
    ----------
    values
        Points and derivatives, shape (N, 3, 3).
    s, t
        Their parameters, shape (N,).
    net
        The patch's homogeneous control net.
    frames
        Evaluates the patch at other parameters.

    Returns
    -------
    FloatArray
        Shape (N, 3).
    """
    bounds = derivative_bounds(net)
    normals, good = _cross(values, bounds, FLAT)
    if not good.all():
        bad = np.flatnonzero(~good)
        normals[bad] = _limits(values[bad], s[bad], t[bad], bounds, frames)
    return normals


def _cross(
    values: FloatArray, bounds: tuple[float, float], least: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return S_s × S_t normalized, and where its length is reliable."""
    a, b = values[:, 1], values[:, 2]
    normals = np.empty((len(values), 3))
    for c in range(3):
        i, j = (c + 1) % 3, (c + 2) % 3
        normals[:, c] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    along_s = np.sqrt(np.einsum("ij,ij->i", a, a))
    along_t = np.sqrt(np.einsum("ij,ij->i", b, b))
    good = length > least * (along_s * bounds[1] + along_t * bounds[0])
    normals /= np.where(good, length, 1.0)[:, None]
    return normals, good


def _limits(
    values: FloatArray, s: FloatArray, t: FloatArray, bounds: tuple[float, float], frames: Frames
) -> FloatArray:
    """Return the limits of the normals; try the way across the collapsed edge first, then the others."""
    inward_s, inward_t = np.where(s <= 0.5, 1.0, -1.0), np.where(t <= 0.5, 1.0, -1.0)
    size_s = np.linalg.norm(values[:, 1], axis=1) * bounds[1]
    size_t = np.linalg.norm(values[:, 2], axis=1) * bounds[0]
    # an edge s = const has collapsed where the derivative along it, by t, is the smaller one
    across_s = size_t <= size_s
    normals = np.tile([0.0, 0.0, 1.0], (len(s), 1))
    todo = np.arange(len(s))
    for way in range(3):
        move_s = np.where(across_s, way != 1, way != 0)[todo] * inward_s[todo]
        move_t = np.where(across_s, way != 0, way != 1)[todo] * inward_t[todo]
        near = frames(
            (s[todo, None] + move_s[:, None] * STEPS).ravel(),
            (t[todo, None] + move_t[:, None] * STEPS).ravel(),
        )
        found, good = _cross(near, bounds, LOST)
        fine = good.reshape(-1, len(STEPS)).all(axis=1)
        limit = found.reshape(-1, len(STEPS), 3)[fine]
        for k in range(1, len(STEPS)):
            limit = limit[:, 1:] + (limit[:, 1:] - limit[:, :-1]) / (2.0**k - 1.0)
        limit = limit[:, 0]
        normals[todo[fine]] = limit / np.linalg.norm(limit, axis=1, keepdims=True)
        todo = todo[~fine]
        if len(todo) == 0:
            break
    return normals
