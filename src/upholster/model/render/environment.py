"""Light on materials: a small sky with lamps, in formulas only, and its reflection by surfaces.

All lighting of pictures is defined here, so that another program can reproduce it. The model's z is up; lamps
and key light turn with the camera, so every view is lit alike. All of it is white.

**What a mirror sees.** The radiance from the unit direction ω is that of a sky, with a dark line along the
horizon, and of lamps i, toward d_i, each with its strength a_i and sharpness k_i::

    L(ω) = m + g·ω_z − h·exp(−(ω_z/w)²) + Σ_i a_i·exp(k_i·(ω·d_i − 1))
    m = (ABOVE + BELOW)/2, g = ¾·(ABOVE − BELOW), h = HORIZON, w = HORIZON_WIDTH

The key light is one more lamp: a = KEY_LIGHT·k/2, with k = KEY_SHARPNESS; shadows decide how much of it
arrives.

**Diffuse light**, over π, on a surface with the unit normal n that the eye sees along v::

    E = BELOW + (ABOVE − BELOW)·(½ + ½·n_z) + FILL·max(n·v, 0) + KEY_LIGHT·max(n·key, 0)

The first two terms are exactly those of the sky's m + g·ω_z. The other lamps only appear in reflections.

**What a rough surface mirrors.** GGX of roughness r, α = r², weights the directions about the mirrored one,
R, approximately as a lobe exp(s·(ω·R − 1)) with s = 2/α²/(4·max(n·v, 0.1)). The mean of L under this lobe
is::

    L(R, s) = m + g·A(s)·R_z − h·(w/w')·exp(−(R_z/w')²) + Σ_i a_i·I(k_i)/I(k')·exp(k'·(R·d_i − 1))
    A(s) = coth s − 1/s, w'² = w² + 2/s, k' = k_i·s/(k_i + s), I(k) = (1 − exp(−2k))/k

It is multiplied by F0·a + b, with F0 = 0.04·(1 − metallic) + albedo·metallic, and Karis' fit of a and b::

    x = 1 − r, y = 0.0425 − 0.0275·r, z = 1.04 − 0.572·r, u = 0.022·r − 0.04
    q = min(x², 2^(−9.28·n·v))·x + y, a = z − 1.04·q, b = u + 1.04·q

References
----------
J. Wang et al.: All-Frequency Rendering of Dynamic, Spatially-Varying Reflectance, SIGGRAPH Asia 2009 (lobes
for GGX). B. Karis: Real Shading in Unreal Engine 4, SIGGRAPH course 2013 (the split), and: Physically Based
Shading on Mobile, 2014 (the fit).
"""

import math

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, frozen_array
from upholster.runtime.jit import inline

__all__ = [
    "FILL_LIGHT", "KEY_LIGHT", "SKY_ABOVE", "SKY_BELOW", "key_mirrored", "lamps", "lobe_sharpness",
    "reflectance", "sky_mirrored",
]  # fmt: skip

Vector = tuple[float, float, float]

# Diffuse light arriving per light, for a white surface that faces it.
SKY_ABOVE, SKY_BELOW, FILL_LIGHT, KEY_LIGHT = 0.50, 0.28, 0.10, 0.50
KEY_SHARPNESS = 24.0
HORIZON, HORIZON_WIDTH = 0.16, 0.14

# To the right, toward the camera and up; strength and sharpness.
_LAMPS = (
    (0.85, 0.10, 0.50, 1.5, 12.0),
    (-0.75, -0.55, 0.35, 1.0, 14.0),
    (0.35, -0.80, 0.50, 0.8, 10.0),
)


def lamps(axes: FloatArray) -> NDArray[np.float64]:
    """Return the lamps for a camera's axes (right, up, forward, as rows): (n, 5), direction, a and k."""
    right = axes[0]
    frame = np.stack([right, np.cross(right, (0.0, 0.0, 1.0)), (0.0, 0.0, 1.0)])
    directions = np.array(_LAMPS)[:, :3]
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True) @ frame
    return frozen_array(np.concatenate([directions, np.array(_LAMPS)[:, 3:]], axis=1))


@inline
def lobe_sharpness(roughness: float, facing: float) -> float:
    """Return s for n·v = `facing`."""
    alpha = max(roughness * roughness, 0.01)
    return 0.5 / (alpha * alpha * max(facing, 0.1))


@inline
def reflectance(roughness: float, facing: float) -> tuple[float, float]:
    """Return a and b; the share F0·a + b is mirrored."""
    x = 1.0 - roughness
    q = min(x * x, 2.0 ** (-9.28 * facing)) * x + 0.0425 - 0.0275 * roughness
    return 1.04 - 0.572 * roughness - 1.04 * q, max(0.022 * roughness - 0.04 + 1.04 * q, 0.0)


@inline
def _lamp(cosine: float, strength: float, k: float, s: float) -> float:
    """Return a lamp under the lobe, its direction at `cosine` from the mirrored one."""
    blurred = k * s / (k + s)
    share = (1.0 - math.exp(-2.0 * k)) / k * blurred / (1.0 - math.exp(-2.0 * blurred))
    return strength * share * math.exp(blurred * (cosine - 1.0))


@inline
def sky_mirrored(mirrored: Vector, s: float, around: NDArray[np.float64]) -> float:
    """Return sky and lamps under the lobe about `mirrored`; `around` is from `lamps`."""
    z = mirrored[2]
    tilt = (1.0 / math.tanh(s) if s < 20.0 else 1.0) - 1.0 / s
    light = 0.5 * (SKY_ABOVE + SKY_BELOW) + 0.75 * (SKY_ABOVE - SKY_BELOW) * tilt * z
    width = math.sqrt(HORIZON_WIDTH * HORIZON_WIDTH + 2.0 / s)
    light -= HORIZON * HORIZON_WIDTH / width * math.exp(-((z / width) ** 2))
    for i in range(len(around)):
        cosine = mirrored[0] * around[i, 0] + mirrored[1] * around[i, 1] + z * around[i, 2]
        light += _lamp(cosine, around[i, 3], around[i, 4], s)
    return light


@inline
def key_mirrored(cosine: float, s: float) -> float:
    """Return the key light under the lobe; `cosine` is between its direction and the mirrored one."""
    return _lamp(cosine, 0.5 * KEY_LIGHT * KEY_SHARPNESS, KEY_SHARPNESS, s)
