"""Kernels of the picture: the light that hits show, and the pixels at the end.

Lengths are in radii of the model, the origin is its middle. A picture is collected per pixel in *sums*, one
row of `SUMS` numbers: light is kept apart from occlusion, because the share of a light that arrives is
averaged over neighbouring pixels (see `upholster.render.light`) before it is multiplied in.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.jit import inline, kernel
from upholster.render._lookup import filtered
from upholster.render.texture import MipPyramid

__all__ = [
    "COVER", "DEPTH", "FLOOR", "LIGHT", "NORMAL", "SUMS", "RayMesh", "Rays", "Studio",
    "resolve", "shade",
]  # fmt: skip

Single = NDArray[np.float32]
Vector = tuple[float, float, float]

# What the numbers of a pixel's sums are. Occlusion is counted in weights: asked for, and of that arrived.
AMBIENT, KEY = 0, 3  # light from sky and camera, and from the key light, times colour: three numbers each
COVER, NORMAL, DEPTH = 6, 7, 10  # alpha; three numbers; least depth
LIGHT = 11  # from here on: what `light.averaged` averages, first of the model, then of the floor
KEY_ASKED, KEY_ARRIVED, SKY_ASKED, SKY_ARRIVED = 11, 12, 13, 14
FLOOR, FLOOR_KEY, FLOOR_SKY = 15, 16, 17  # on the floor both lights are always asked for
SUMS = 18

# Light arriving per light, for a white surface that faces it.
SKY_ABOVE, SKY_BELOW, FILL_LIGHT, KEY_LIGHT = 0.50, 0.28, 0.10, 0.50
SHEEN, GLOSS, GLOSS_POWER = 0.16, 0.9, 32
AO_STRENGTH = 0.8
# Light above the knee is compressed toward 1, all channels alike, so that hue stays.
KNEE = 0.9
# Where a ray leaves a surface, it starts this far off.
LIFT = 1e-3
# How far away something has to be not to take sky light, on the model and on the floor.
REACH, FLOOR_REACH, FAR = 1.0, 2.0, 1e30


class RayMesh(NamedTuple):
    """The model: triangles, and what their vertices carry."""

    triangles: NDArray[np.int32]  # (N, 3)
    positions: Single  # (V, 3)
    normals: Single  # (V, 3), of any length
    uv: Single  # (V, 2)


class Studio(NamedTuple):
    """Camera and lights."""

    eye: NDArray[np.float64]  # (3,)
    right: NDArray[np.float64]  # (3,) unit
    up: NDArray[np.float64]  # (3,) unit
    key: NDArray[np.float64]  # (3,) toward the key light, unit
    floor: float  # height of the floor, -inf for none
    spread: float  # distance between two samples at depth 1
    pattern: Single  # see `light.occlusion_pattern`, as (n, 6); with no rows, nothing is occluded
    samples: int  # per pixel


class Rays(NamedTuple):
    """Occlusion rays: where one meets nothing, its weight is to be added to ``sums.flat[slots]``."""

    origins: Single  # (n, 3)
    directions: Single  # (n, 3), unit
    reach: Single  # (n,) how far to look
    slots: NDArray[np.int64]  # (n,)
    weights: Single  # (n,)


@inline
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inline
def _along(a: Vector, t: float, b: Vector) -> Vector:
    """Return a + t·b."""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@inline
def _scaled(a: Vector, t: float) -> Vector:
    return a[0] * t, a[1] * t, a[2] * t


@inline
def _row(array: NDArray[Any], i: int) -> Vector:
    return np.float64(array[i, 0]), np.float64(array[i, 1]), np.float64(array[i, 2])


@inline
def _misses_model(p: Vector, d: Vector) -> bool:
    """Return whether the ray from p along the unit vector d misses the unit ball, which holds the model."""
    along = _dot(p, d)
    outside = _dot(p, p) - 1.0
    return outside > 0.0 and (along >= 0.0 or along * along < outside)


@inline
def _turned(local: Vector, n: Vector) -> Vector:
    """Return a vector about (0, 0, 1) turned to lie about the unit vector n (Duff et al., JCGT 2017)."""
    sign = 1.0 if n[2] >= 0.0 else -1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    tangent = (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])
    other = (b, sign + n[1] * n[1] * a, -n[1])
    return _along(_along(_scaled(tangent, local[0]), local[1], other), local[2], n)


@inline
def _ask(
    rays: Rays, count: int, origin: Vector, direction: Vector, reach: float, slot: int, weight: float
) -> int:
    """List one occlusion ray; return how many there are."""
    for k in range(3):
        rays.origins[count, k] = origin[k]
        rays.directions[count, k] = direction[k]
    rays.reach[count] = reach
    rays.slots[count] = slot
    rays.weights[count] = weight
    return count + 1


@kernel
def shade(
    hit: NDArray[np.int32],
    hit_u: Single,
    hit_v: Single,
    directions: Single,
    pixels: NDArray[np.int64],
    aims: NDArray[np.int32],
    through: Single,
    onward: Single,
    mesh: RayMesh,
    pyramid: MipPyramid,
    studio: Studio,
    sums: Single,
    rays: Rays,
) -> int:
    """Add the light along each ray to its pixel's sums, and list the occlusion rays that this asks for.

    Parameters
    ----------
    hit, hit_u, hit_v
        (n,): the triangle met, -1 if none, and the weights of its second and third corner.
    directions
        (n, 3): from the eye, 1 long along forward.
    pixels, aims
        (n,): each ray's row of `sums` and of the pattern.
    through
        (n,): the share of light that what lies before lets through; updated.
    onward
        (n, 3): filled with where to go on behind what was met.
    mesh, pyramid, studio
        What is seen and how.
    sums
        (pixels, SUMS): updated.
    rays
        Room for 2·n: filled.

    Returns
    -------
    int
        Number of occlusion rays.

    References
    ----------
    J. Hanika: Hacking the Shadow Terminator, Ray Tracing Gems II, 2021 (where occlusion rays start).
    """
    eye = (studio.eye[0], studio.eye[1], studio.eye[2])
    right = (studio.right[0], studio.right[1], studio.right[2])
    up = (studio.up[0], studio.up[1], studio.up[2])
    key = (studio.key[0], studio.key[1], studio.key[2])
    occlusion = len(studio.pattern) > 0
    count = 0
    for i in range(len(hit)):
        total = sums[pixels[i]]
        slot = pixels[i] * SUMS
        weight = np.float64(through[i])
        through[i] = 0.0
        d = _row(directions, i)
        if occlusion:
            aim = studio.pattern[aims[i]]
            to_key = (np.float64(aim[0]), np.float64(aim[1]), np.float64(aim[2]))
            to_sky = (np.float64(aim[3]), np.float64(aim[4]), np.float64(aim[5]))

        if hit[i] < 0:
            if occlusion and d[2] < 0.0 and studio.floor < eye[2]:
                p = _along(eye, (studio.floor - eye[2]) / d[2], d)
                total[FLOOR] += weight
                if _misses_model(p, to_key):
                    total[FLOOR_KEY] += weight
                else:
                    count = _ask(rays, count, p, to_key, FAR, slot + FLOOR_KEY, weight)
                if _misses_model(p, to_sky):
                    total[FLOOR_SKY] += weight
                else:
                    count = _ask(rays, count, p, to_sky, FLOOR_REACH, slot + FLOOR_SKY, weight)
            continue

        i0, i1, i2 = mesh.triangles[hit[i]]
        w1, w2 = np.float64(hit_u[i]), np.float64(hit_v[i])
        w0 = 1.0 - w1 - w2
        p0, p1, p2 = _row(mesh.positions, i0), _row(mesh.positions, i1), _row(mesh.positions, i2)
        n0, n1, n2 = _row(mesh.normals, i0), _row(mesh.normals, i1), _row(mesh.normals, i2)
        p = _along(_along(_scaled(p0, w0), w1, p1), w2, p2)
        n = _along(_along(_scaled(n0, w0), w1, n1), w2, n2)
        edge1, edge2 = _along(p1, -1.0, p0), _along(p2, -1.0, p0)
        flat = _cross(edge1, edge2)
        area = max(math.sqrt(_dot(flat, flat)), 1e-30)
        flat = _scaled(flat, 1.0 / area)
        # One corner's share grows along these, per unit of length.
        rise1, rise2 = _scaled(_cross(edge2, flat), 1.0 / area), _scaled(_cross(flat, edge1), 1.0 / area)
        length = math.sqrt(_dot(n, n))
        n = _scaled(n, 1.0 / length) if length > 1e-6 else flat
        if _dot(flat, n) < 0.0:
            flat = _scaled(flat, -1.0)
        slope = _dot(flat, d)
        side = 1.0
        if slope > 0.0:  # seen from behind
            side = -1.0
            n, flat = _scaled(n, -1.0), _scaled(flat, -1.0)

        distance = math.sqrt(_dot(d, d))
        toward_eye = _scaled(d, -1.0 / distance)
        depth = _dot(_along(p, -1.0, eye), d) / (distance * distance)
        u0, v0 = np.float64(mesh.uv[i0, 0]), np.float64(mesh.uv[i0, 1])
        ua, va = mesh.uv[i1, 0] - u0, mesh.uv[i1, 1] - v0
        ub, vb = mesh.uv[i2, 0] - u0, mesh.uv[i2, 1] - v0
        # Where the next samples to the right and above meet the triangle's plane, seen flat at most 1 : 50.
        slope = min(slope, -0.02 * distance) if side > 0.0 else min(-slope, -0.02 * distance)
        step = depth * studio.spread
        across = _scaled(_along(right, -_dot(flat, right) / slope, d), step)
        above = _scaled(_along(up, -_dot(flat, up) / slope, d), step)
        s1, s2 = _dot(across, rise1), _dot(across, rise2)
        one = ((s1 * ua + s2 * ub) * pyramid.width, (s1 * va + s2 * vb) * pyramid.height)
        s1, s2 = _dot(above, rise1), _dot(above, rise2)
        two = ((s1 * ua + s2 * ub) * pyramid.width, (s1 * va + s2 * vb) * pyramid.height)
        red, green, blue, alpha = filtered(pyramid, u0 + w1 * ua + w2 * ub, v0 + w1 * va + w2 * vb, one, two)

        through[i] = weight * (1.0 - alpha)
        beyond = _along(p, -LIFT, toward_eye)
        onward[i, 0], onward[i, 1], onward[i, 2] = beyond
        cover = weight * alpha
        if cover <= 0.0:
            continue
        facing = max(_dot(n, toward_eye), 0.0)
        from_key = max(_dot(n, key), 0.0)
        ambient = SKY_BELOW + (SKY_ABOVE - SKY_BELOW) * (0.5 + 0.5 * n[2]) + FILL_LIGHT * facing
        half = _along(key, 1.0, toward_eye)
        half = _scaled(half, 1.0 / max(math.sqrt(_dot(half, half)), 1e-6))
        # Schlick's Fresnel term for both reflections, of the sky and of the key light.
        sheen = SHEEN * (0.04 + 0.96 * (1.0 - facing) ** 5) * (0.5 + 0.5 * n[2])
        glint = 0.0
        if from_key > 0.0:
            fresnel = 0.04 + 0.96 * (1.0 - max(_dot(half, key), 0.0)) ** 5
            glint = GLOSS * fresnel * max(_dot(n, half), 0.0) ** GLOSS_POWER
        light = (weight * red, weight * green, weight * blue)
        for k in range(3):
            total[AMBIENT + k] += light[k] * ambient + cover * sheen
            total[KEY + k] += light[k] * KEY_LIGHT * from_key + cover * glint
            total[NORMAL + k] += cover * n[k]
        fresh = total[COVER] == 0.0
        total[COVER] += cover
        if alpha >= 0.5:
            total[DEPTH] = min(total[DEPTH], depth)
        if not occlusion:
            continue
        # Start above the smooth surface that the flat triangles stand for, or they would shade one another.
        origin = _along(p, LIFT, flat)
        for w, corner, normal in ((w0, p0, n0), (w1, p1, n1), (w2, p2, n2)):
            below = side * _dot(_along(p, -1.0, corner), normal)
            if below < 0.0:
                origin = _along(origin, -w * below * side, normal)
        # Samples take turns: half of them are plenty for either light once averaged. The first of a pixel
        # asks for both, so that no pixel is left without an answer of its own.
        both = fresh or studio.samples == 1
        if from_key > 0.0 and (both or aims[i] % 2 == 0):
            total[KEY_ASKED] += cover
            count = _ask(rays, count, origin, to_key, FAR, slot + KEY_ARRIVED, cover)
        if both or aims[i] % 2 == 1:
            total[SKY_ASKED] += cover
            count = _ask(rays, count, origin, _turned(to_sky, n), REACH, slot + SKY_ARRIVED, cover)
    return count


@inline
def _share(lights: Single, y: int, x: int, asked: int, arrived: int) -> float:
    """Return which share of a light arrives; all of it where nobody asked."""
    return (
        lights[arrived - LIGHT, y, x] / lights[asked - LIGHT, y, x]
        if lights[asked - LIGHT, y, x] > 0.0
        else 1.0
    )


@kernel
def resolve(
    sums: Single, lights: Single, start: int, studio: Studio, background: Single, image: Single
) -> None:
    """Turn sums into pixels.

    Parameters
    ----------
    sums
        (rows, width, SUMS), rows above and below the image included.
    lights
        (SUMS - LIGHT, rows, width): the sums from LIGHT on, averaged.
    start
        The image's first row in `sums`.
    studio
        As for `shade`.
    background
        (height, 3): one colour per row of the image; or (0, 3) for a transparent one.
    image
        (height, width, 3), or 4 with alpha, not premultiplied: filled.
    """
    share = 1.0 / studio.samples
    floor_key, floor_sky = KEY_LIGHT * max(studio.key[2], 0.0), SKY_ABOVE
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            total, row = sums[start + y, x], start + y
            cover = total[COVER] * share
            key = _share(lights, row, x, KEY_ASKED, KEY_ARRIVED)
            sky = 1.0 - AO_STRENGTH * (1.0 - _share(lights, row, x, SKY_ASKED, SKY_ARRIVED))
            on_floor = floor_key * _share(lights, row, x, FLOOR, FLOOR_KEY)
            on_floor += floor_sky * _share(lights, row, x, FLOOR, FLOOR_SKY)
            shadow = total[FLOOR] * share * (1.0 - on_floor / (floor_key + floor_sky))
            brightest = 0.0
            for k in range(3):
                image[y, x, k] = (total[AMBIENT + k] * sky + total[KEY + k] * key) * share
                brightest = max(brightest, image[y, x, k])
            if brightest > KNEE * cover and cover > 0.0:
                over = (brightest / cover - KNEE) / (1.0 - KNEE)
                fitted = cover * (1.0 - (1.0 - KNEE) * math.exp(-over))
                for k in range(3):
                    image[y, x, k] *= fitted / brightest
            rest = max(1.0 - cover - shadow, 0.0)
            if len(background) > 0:
                for k in range(3):
                    image[y, x, k] += rest * background[y, k]
            else:
                image[y, x, 3] = 1.0 - rest
                if rest < 1.0:
                    for k in range(3):
                        image[y, x, k] /= 1.0 - rest
