"""Kernels of materials: the light from a place with normal, roughness, metal, occlusion and emission."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.model.render._lookup import Color, Pair, filtered
from upholster.model.render.environment import (
    FILL_LIGHT,
    KEY_LIGHT,
    SKY_ABOVE,
    SKY_BELOW,
    key_mirrored,
    lobe_sharpness,
    reflectance,
    sky_mirrored,
)
from upholster.model.render.texture import MipPyramid
from upholster.runtime.jit import inline, shared

__all__ = ["Shine", "SurfaceMaps", "material_light"]

Vector = tuple[float, float, float]


class SurfaceMaps(NamedTuple):
    """A material's maps other than the base colour.

    Attributes
    ----------
    used
        Whether there are any; if not, the other fields are empty.
    detail
        Normal x and y, coded as (v + 1)/2, roughness, metallic.
    glow
        Emission, linear, and occlusion.
    glows
        Whether `glow` is used.
    tangents
        (V, 3) float32: along the texture's columns at the mesh's vertices, of any length; (0, 3) without a
        normal map.
    normal_scale
        Factor for x and y of normals.
    lamps
        See `upholster.model.render.environment.lamps`.
    """

    used: bool
    detail: MipPyramid
    glow: MipPyramid
    glows: bool
    tangents: NDArray[np.float32]
    normal_scale: float
    lamps: NDArray[np.float64]


class Shine(NamedTuple):
    """Light from a place toward the eye, times its alpha."""

    ambient: Vector  # from sky and lamps
    key: Vector  # from the key light
    glow: Vector  # emitted


@inline
def _bent(normal: Vector, tangent: Vector, side: float, x: float, y: float) -> Vector:
    """Return the surface's normal, bent by a map's x and y in glTF's frame T, B = N × T, N."""
    along = tangent[0] * normal[0] + tangent[1] * normal[1] + tangent[2] * normal[2]
    t0, t1, t2 = (
        tangent[0] - along * normal[0],
        tangent[1] - along * normal[1],
        tangent[2] - along * normal[2],
    )
    length = math.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    if length < 1e-12:
        return normal
    # N points outward; it is reversed if the surface is seen from behind, and the result is reversed again.
    u, v = side * x / length, y / length
    z = math.sqrt(max(1.0 - x * x - y * y, 0.0))
    n0 = u * t0 + v * (normal[1] * t2 - normal[2] * t1) + z * normal[0]
    n1 = u * t1 + v * (normal[2] * t0 - normal[0] * t2) + z * normal[1]
    n2 = u * t2 + v * (normal[0] * t1 - normal[1] * t0) + z * normal[2]
    length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    return (n0 / length, n1 / length, n2 / length) if length > 1e-6 else normal


@shared
def material_light(
    maps: SurfaceMaps, place: Pair, one: Pair, two: Pair, color: Color,
    normal: Vector, tangent: Vector, side: float, toward_eye: Vector, key: Vector,
) -> Shine:  # fmt: skip
    """Return the light from a place.

    Parameters
    ----------
    maps
        The material.
    place, one, two
        Texture coordinates, and the footprint in texels.
    color
        Base colour times alpha, and alpha.
    normal, tangent, side
        The smooth surface's unit normal toward the eye, and T, of any length, or zero; -1 if it is seen
        from behind.
    toward_eye, key
        Unit vectors.
    """
    x, y, roughness, metallic = filtered(maps.detail, place[0], place[1], one, two)
    red, green, blue, open_ = 0.0, 0.0, 0.0, 1.0
    if maps.glows:
        red, green, blue, open_ = filtered(maps.glow, place[0], place[1], one, two)
    x, y = maps.normal_scale * (2.0 * x - 1.0), maps.normal_scale * (2.0 * y - 1.0)
    n0, n1, n2 = _bent(normal, tangent, side, x, y)
    facing = n0 * toward_eye[0] + n1 * toward_eye[1] + n2 * toward_eye[2]
    r0, r1, r2 = (
        2.0 * facing * n0 - toward_eye[0],
        2.0 * facing * n1 - toward_eye[1],
        2.0 * facing * n2 - toward_eye[2],
    )
    facing = max(facing, 0.0)
    # Where the surface itself turns away, bumps get no light, and reflect nothing from below it.
    toward_key = normal[0] * key[0] + normal[1] * key[1] + normal[2] * key[2]
    lit = min(max(4.0 * toward_key, 0.0), 1.0)
    above = min(max(1.0 + 2.0 * (r0 * normal[0] + r1 * normal[1] + r2 * normal[2]), 0.0), 1.0)

    diffuse = SKY_BELOW + (SKY_ABOVE - SKY_BELOW) * (0.5 + 0.5 * n2) + FILL_LIGHT * facing
    direct = KEY_LIGHT * lit * max(n0 * key[0] + n1 * key[1] + n2 * key[2], 0.0)
    s = lobe_sharpness(roughness, facing)
    sky = above * sky_mirrored((r0, r1, r2), s, maps.lamps)
    glint = lit * key_mirrored(r0 * key[0] + r1 * key[1] + r2 * key[2], s)
    a, b = reflectance(roughness, facing)
    base, white = 1.0 - metallic, 0.04 * (1.0 - metallic) * a * color[3] + b * color[3]
    m0, m1, m2 = (
        white + metallic * a * color[0],
        white + metallic * a * color[1],
        white + metallic * a * color[2],
    )
    return Shine(
        (
            open_ * (base * color[0] * diffuse + m0 * sky),
            open_ * (base * color[1] * diffuse + m1 * sky),
            open_ * (base * color[2] * diffuse + m2 * sky),
        ),
        (
            base * color[0] * direct + m0 * glint,
            base * color[1] * direct + m1 * glint,
            base * color[2] * direct + m2 * glint,
        ),
        (red * color[3], green * color[3], blue * color[3]),
    )
