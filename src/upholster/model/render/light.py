"""The studio: the positions of the lights, and the fixed pattern of rays that tests how much of it arrives.

Lights are attached to the camera, so every view is lit alike: a key light over the photographer's left
shoulder, a little fill from the camera, and a sky that is brighter above than below. They are white and sum
to about 1 where a surface faces the key light, so that a texture keeps its colours.
"""

import math

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, frozen_array
from upholster.model.render._kernels import COVER, DEPTH, FLOOR, LIGHT, NORMAL

__all__ = ["MARGIN", "TILE", "averaged", "key_direction", "occlusion_pattern"]

KEY_TO_CAMERA = (-0.46, 0.62, 0.64)
"""Toward the key light, in the camera's axes (right, up, backward)."""

KEY_RADIUS = 0.09
"""Radius of the key light as a tangent of angle: it sets the softness of its shadows."""

TILE = 8
"""The pattern repeats every TILE pixels each way; averaging over as many removes it again."""

MARGIN = TILE // 2
"""Pixels on either side over which it is averaged."""

# Order of a tile's pixels such that near ones are far apart in the sequence (Bayer's ordered dither).
_BAYER = np.array([[0, 2], [3, 1]])
for _ in range(2):
    _BAYER = np.block([[4 * _BAYER, 4 * _BAYER + 2], [4 * _BAYER + 3, 4 * _BAYER + 1]])
# The root of g³ = g + 1: fractional parts of multiples of (1/g, 1/g²) cover the square most evenly.
_ROOT = 1.324717957244746


def key_direction(axes: FloatArray) -> FloatArray:
    """Return the (3,) unit vector toward the key light for a camera's axes (right, up, forward, as rows)."""
    key = np.array([*KEY_TO_CAMERA[:2], -KEY_TO_CAMERA[2]]) @ axes
    return np.asarray(key / np.linalg.norm(key))


def occlusion_pattern(axes: FloatArray, supersample: int) -> NDArray[np.float32]:
    """Return the directions in which a picture's samples test for light.

    Parameters
    ----------
    axes
        (3, 3): the camera's right, up and forward, as rows.
    supersample
        Samples per pixel each way.

    Returns
    -------
    ndarray
        (TILE²·supersample², 6) float32, read-only: per pixel of a tile, row by row, and per sample, a unit
        vector toward a point of the key light, in the model's axes, and one toward the sky, cosine-weighted
        about (0, 0, 1). The same at any time and on any machine.

    References
    ----------
    M. Roberts: The Unreasonable Effectiveness of Quasirandom Sequences, 2018 (the sequence). A. Keller,
    W. Heidrich: Interleaved Sampling, EGWR 2001 (one pattern shared among a tile's pixels).
    """
    samples = supersample**2
    index = _BAYER[:, :, None] * samples + np.arange(samples)
    one, two = np.mod(0.5 + index / _ROOT, 1.0), np.mod(0.5 + index / _ROOT**2, 1.0)

    key = key_direction(axes)
    side = np.cross(key, axes[0])
    side /= np.linalg.norm(side)
    other = np.cross(key, side)
    radius, angle = KEY_RADIUS * np.sqrt(one), 2 * math.pi * two
    toward_key = (
        key + (radius * np.cos(angle))[..., None] * side + (radius * np.sin(angle))[..., None] * other
    )
    toward_key /= np.linalg.norm(toward_key, axis=-1, keepdims=True)

    radius, angle = np.sqrt(one), 2 * math.pi * two
    toward_sky = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)], axis=-1)
    pattern = np.concatenate([toward_key, toward_sky], axis=-1).reshape(-1, 6)
    return frozen_array(pattern.astype(np.float32))


def averaged(sums: NDArray[np.float32], pixel: float) -> NDArray[np.float32]:
    """Return the occlusion part of the sums, averaged over 9 × 9 pixels, which removes the pattern.

    Half weights at the rim make the weights sum to the same over every tile of 8 × 8. On the model, only
    pixels that show about the same place of it count: normals within 32° and similar depths.

    Parameters
    ----------
    sums
        (rows, width, SUMS) float32, see `upholster.model.render._kernels`.
    pixel
        A pixel's width at depth 1.

    Returns
    -------
    ndarray
        (SUMS - LIGHT, rows, width) float32: the sums from LIGHT on.
    """
    lights = np.ascontiguousarray(np.moveaxis(sums[..., LIGHT:], -1, 0))
    normals = np.moveaxis(sums[..., NORMAL : NORMAL + 3], -1, 0)
    normals = normals / np.maximum(np.sqrt((normals**2).sum(axis=0)), np.float32(1e-12))
    # Where the depth is unknown, nothing is similar.
    depths = np.where(np.isfinite(sums[..., DEPTH]), sums[..., DEPTH], np.float32(1e9) * sums[..., COVER])
    tolerances = np.minimum(0.03 + 8 * pixel * depths, 1.0).astype(np.float32)
    return _averaged(_averaged(lights, normals, depths, tolerances, 2), normals, depths, tolerances, 1)


def _averaged(
    lights: NDArray[np.float32],
    normals: NDArray[np.float32],
    depths: NDArray[np.float32],
    tolerances: NDArray[np.float32],
    axis: int,
) -> NDArray[np.float32]:
    """Average along one axis, 1 down or 2 across; first one, then the other."""
    result = lights.copy()
    model, floor = slice(0, FLOOR - LIGHT), slice(FLOOR - LIGHT, None)
    for step in range(1, min(MARGIN, lights.shape[axis] - 1) + 1):
        weight = np.float32(0.5 if step == MARGIN else 1.0)
        head, tail, whole = slice(None, -step), slice(step, None), slice(None)
        one, two = ((head, whole), (tail, whole)) if axis == 1 else ((whole, head), (whole, tail))
        cosine = np.einsum("kyx,kyx->yx", normals[:, *one], normals[:, *two])
        alike = (cosine > 0.85) & (np.abs(depths[one] - depths[two]) < tolerances[one])
        share = weight * alike.astype(np.float32)
        result[model, *one] += share * lights[model, *two]
        result[model, *two] += share * lights[model, *one]
        result[floor, *one] += weight * lights[floor, *two]
        result[floor, *two] += weight * lights[floor, *one]
    return result
