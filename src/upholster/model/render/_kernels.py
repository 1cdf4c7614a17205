"""Kernels of the picture: the light at each hit, and the final pixels.

Lengths are in radii of the model, the origin is its middle. A picture is accumulated per pixel in *sums*, one
row of `SUMS` numbers. Light is kept apart from occlusion, because the share of a light that arrives is
averaged over neighbouring pixels (see `upholster.model.render.light`) before they are multiplied.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.model.render._lookup import Color, Pair, filtered
from upholster.model.render._material_kernels import SurfaceMaps, material_light
from upholster.model.render.environment import FILL_LIGHT, KEY_LIGHT, SKY_ABOVE, SKY_BELOW
from upholster.model.render.texture import MipPyramid
from upholster.runtime.jit import inline, kernel, spliced

__all__ = [
    "COVER", "DEPTH", "FLOOR", "LIGHT", "NORMAL", "SUMS", "EyeRays", "RayMesh", "Rays", "Scene",
    "resolve", "shade",
]  # fmt: skip

Single = NDArray[np.float32]
Vector = tuple[float, float, float]

# The layout of a pixel's sums. Occlusion is counted in weights: of rays asked for, and of those that arrived.
AMBIENT, KEY = 0, 3  # light from sky and camera, and from the key light, times colour: three numbers each
GLOW = 6  # emitted light: three numbers
COVER, NORMAL, DEPTH = 9, 10, 13  # alpha; three numbers; least depth
LIGHT = 14  # from here on: averaged by `light.averaged`, first for the model, then for the floor
KEY_ASKED, KEY_ARRIVED, SKY_ASKED, SKY_ARRIVED = 14, 15, 16, 17
FLOOR, FLOOR_KEY, FLOOR_SKY = 18, 19, 20  # on the floor both lights are always asked for
SUMS = 21

# Sky and key light that a surface without a material mirrors.
SHEEN, GLOSS, GLOSS_POWER = 0.16, 0.9, 32
AO_STRENGTH = 0.8
# Light above the knee is compressed toward 1, all channels equally, so that hue stays.
KNEE = 0.9
# Mirrored lamps lose their hue above this level; otherwise they would be flat coloured discs.
PALE, PALE_RANGE = 1.5, 4.0
# Rays that leave a surface start this far from it.
LIFT = 1e-3
# Objects farther away than this do not block sky light, on the model and on the floor.
REACH, FLOOR_REACH, FAR = 1.0, 2.0, 1e30


class RayMesh(NamedTuple):
    """The model: triangles and their vertices' attributes."""

    triangles: NDArray[np.int32]  # (N, 3)
    positions: Single  # (V, 3)
    normals: Single  # (V, 3), of any length
    uv: Single  # (V, 2)


class Scene(NamedTuple):
    """Camera and lights."""

    eye: NDArray[np.float64]  # (3,)
    right: NDArray[np.float64]  # (3,) unit
    up: NDArray[np.float64]  # (3,) unit
    key: NDArray[np.float64]  # (3,) toward the key light, unit
    floor: float  # height of the floor, -inf for none
    spread: float  # distance between two samples at depth 1
    pattern: Single  # see `light.occlusion_pattern`, as (n, 6); with no rows, nothing is occluded
    samples: int  # per pixel
    pales: bool  # whether light far above 1 turns white: with materials, which mirror lamps


class EyeRays(NamedTuple):
    """Rays from the eye, and their hits."""

    hit: NDArray[np.int32]  # (n,) the triangle met, -1 if none
    u: Single  # (n,) share of its second corner
    v: Single  # (n,) share of its third corner
    directions: Single  # (n, 3): 1 long along forward
    pixels: NDArray[np.int64]  # (n,) each ray's row of the sums
    aims: NDArray[np.int32]  # (n,) each ray's row of the pattern
    through: Single  # (n,) the share of light that surfaces in front let through; updated
    onward: Single  # (n, 3) where to continue after the hit; filled


class Rays(NamedTuple):
    """Occlusion rays: if a ray meets nothing, its weight is to be added to ``sums.flat[slots]``."""

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
def _vector(array: NDArray[Any]) -> Vector:
    return np.float64(array[0]), np.float64(array[1]), np.float64(array[2])


@inline
def _misses_model(p: Vector, d: Vector) -> bool:
    """Return whether the ray from p along the unit vector d misses the unit ball, which holds the model."""
    along = _dot(p, d)
    outside = _dot(p, p) - 1.0
    return outside > 0.0 and (along >= 0.0 or along * along < outside)


@inline
def _turned(local: Vector, n: Vector) -> Vector:
    """Return a vector about (0, 0, 1), turned to be about the unit vector n (Duff et al., JCGT 2017)."""
    sign = 1.0 if n[2] >= 0.0 else -1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    tangent = (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])
    other = (b, sign + n[1] * n[1] * a, -n[1])
    return _along(_along(_scaled(tangent, local[0]), local[1], other), local[2], n)


@spliced
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


Corner = tuple[float, Vector, Vector]
"""A corner's barycentric share of a place in a triangle, the corner's position, and its normal."""


class EyeRay(NamedTuple):
    """A ray from the eye."""

    direction: Vector  # 1 long along forward
    length: float
    weight: float  # the share of light along it that arrives
    total: Single  # its pixel's sums
    slot: int  # where they begin in ``sums.flat``
    aim: int  # its row of the pattern


class Met(NamedTuple):
    """The place where a ray meets a triangle, with the triangle's own order of corners."""

    corners: tuple[Corner, Corner, Corner]
    place: Vector
    normal: Vector  # of the smooth surface, unit, toward the eye
    flat: Vector  # of the triangle, unit, on the same side
    rises: tuple[Vector, Vector]  # the second and third share increase along these, per unit of length
    side: float  # 1, or -1 where the triangle is seen from behind


class Light(NamedTuple):
    """How light falls on a place."""

    ambient: float  # of the surface's colour, from sky and camera
    key: float  # from 0 to 1: how far the surface faces the key light
    sheen: float  # white, reflected from the sky
    glint: float  # white, reflected from the key light


class Shown(NamedTuple):
    """What the texture shows at a place."""

    place: Pair  # texture coordinates
    footprint: tuple[Pair, Pair]  # how far away the next samples to the right and above are, in texels
    color: Color  # times alpha, and alpha


@spliced
def _floor_light(ray: EyeRay, studio: Scene, rays: Rays, count: int) -> int:
    """Add the floor's light for a ray that misses the model, and request rays to both lights there."""
    eye, d, total, weight = _vector(studio.eye), ray.direction, ray.total, ray.weight
    if not (d[2] < 0.0 and studio.floor < eye[2]):
        return count
    aim = studio.pattern[ray.aim]
    to_key, to_sky = _vector(aim), _vector(aim[3:])
    p = _along(eye, (studio.floor - eye[2]) / d[2], d)
    total[FLOOR] += weight
    if _misses_model(p, to_key):
        total[FLOOR_KEY] += weight
    else:
        count = _ask(rays, count, p, to_key, FAR, ray.slot + FLOOR_KEY, weight)
    if _misses_model(p, to_sky):
        total[FLOOR_SKY] += weight
    else:
        count = _ask(rays, count, p, to_sky, FLOOR_REACH, ray.slot + FLOOR_SKY, weight)
    return count


@spliced
def _met(mesh: RayMesh, corners: tuple[int, int, int], w1: float, w2: float, d: Vector) -> Met:
    """Return place, normals and sides where a ray along d meets a triangle; w1 and w2 are its shares."""
    i0, i1, i2 = corners
    p0, p1, p2 = _row(mesh.positions, i0), _row(mesh.positions, i1), _row(mesh.positions, i2)
    n0, n1, n2 = _row(mesh.normals, i0), _row(mesh.normals, i1), _row(mesh.normals, i2)
    w0 = 1.0 - w1 - w2
    p = _along(_along(_scaled(p0, w0), w1, p1), w2, p2)
    n = _along(_along(_scaled(n0, w0), w1, n1), w2, n2)
    edge1, edge2 = _along(p1, -1.0, p0), _along(p2, -1.0, p0)
    flat = _cross(edge1, edge2)
    area = max(math.sqrt(_dot(flat, flat)), 1e-30)
    flat = _scaled(flat, 1.0 / area)
    rises = (_scaled(_cross(edge2, flat), 1.0 / area), _scaled(_cross(flat, edge1), 1.0 / area))
    length = math.sqrt(_dot(n, n))
    n = _scaled(n, 1.0 / length) if length > 1e-6 else flat
    if _dot(flat, n) < 0.0:
        flat = _scaled(flat, -1.0)
    side = 1.0
    if _dot(flat, d) > 0.0:
        side = -1.0
        n, flat = _scaled(n, -1.0), _scaled(flat, -1.0)
    return Met(((w0, p0, n0), (w1, p1, n1), (w2, p2, n2)), p, n, flat, rises, side)


@spliced
def _footprint(met: Met, studio: Scene, ray: EyeRay, step: float, one: Pair, two: Pair) -> tuple[Pair, Pair]:
    """Return how far away the next samples to the right and above are, in the units of `one` and `two`.

    `one` and `two` are the offsets of the triangle's second and third corner from the first on the texture;
    `step` is the distance between samples at this depth.
    """
    right, up, d = _vector(studio.right), _vector(studio.up), ray.direction
    # Where their rays meet the triangle's plane, at a slope of 1 : 50 or more.
    slope = min(_dot(met.flat, d), -0.02 * ray.length)
    across = _scaled(_along(right, -_dot(met.flat, right) / slope, d), step)
    above = _scaled(_along(up, -_dot(met.flat, up) / slope, d), step)
    a, b = _dot(across, met.rises[0]), _dot(across, met.rises[1])
    c, e = _dot(above, met.rises[0]), _dot(above, met.rises[1])
    return (
        (a * one[0] + b * two[0], a * one[1] + b * two[1]),
        (c * one[0] + e * two[0], c * one[1] + e * two[1]),
    )


@spliced
def _look_up(
    mesh: RayMesh, pyramid: MipPyramid, corners: tuple[int, int, int], met: Met, studio: Scene, ray: EyeRay,
    depth: float,
) -> Shown:  # fmt: skip
    """Return what the texture shows where a ray meets the model."""
    i0, i1, i2 = corners
    w1, w2 = met.corners[1][0], met.corners[2][0]
    u0, v0 = np.float64(mesh.uv[i0, 0]), np.float64(mesh.uv[i0, 1])
    ua, va = mesh.uv[i1, 0] - u0, mesh.uv[i1, 1] - v0
    ub, vb = mesh.uv[i2, 0] - u0, mesh.uv[i2, 1] - v0
    one, two = _footprint(met, studio, ray, depth * studio.spread, (ua, va), (ub, vb))
    one = (one[0] * pyramid.width, one[1] * pyramid.height)
    two = (two[0] * pyramid.width, two[1] * pyramid.height)
    place = (u0 + w1 * ua + w2 * ub, v0 + w1 * va + w2 * vb)
    return Shown(place, (one, two), filtered(pyramid, place[0], place[1], one, two))


@spliced
def _light(n: Vector, toward_eye: Vector, key: Vector) -> Light:
    """Return how light falls on a place with the unit normal n."""
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
    return Light(ambient, from_key, sheen, glint)


@spliced
def _above_smooth(met: Met) -> Vector:
    """Return where occlusion rays start: above the smooth surface that the flat triangles approximate.

    Otherwise the triangles would shade one another.
    """
    origin = _along(met.place, LIFT, met.flat)
    for k in range(3):
        share, corner, normal = met.corners[k]
        below = met.side * _dot(_along(met.place, -1.0, corner), normal)
        if below < 0.0:
            origin = _along(origin, -share * below * met.side, normal)
    return origin


@spliced
def _add_material(
    ray: EyeRay, maps: SurfaceMaps, corners: tuple[int, int, int], met: Met, shown: Shown, toward_eye: Vector,
    key: Vector,
) -> None:  # fmt: skip
    """Add the light from a place of a material with several maps."""
    tangent = (0.0, 0.0, 0.0)
    if len(maps.tangents) > 0:
        i0, i1, i2 = corners
        w1, w2 = met.corners[1][0], met.corners[2][0]
        t0, t1, t2 = _row(maps.tangents, i0), _row(maps.tangents, i1), _row(maps.tangents, i2)
        tangent = _along(_along(_scaled(t0, 1.0 - w1 - w2), w1, t1), w2, t2)
    shine = material_light(
        maps, shown.place, shown.footprint[0], shown.footprint[1], shown.color,
        met.normal, tangent, met.side, toward_eye, key,
    )  # fmt: skip
    for k in range(3):
        ray.total[AMBIENT + k] += ray.weight * shine.ambient[k]
        ray.total[KEY + k] += ray.weight * shine.key[k]
        ray.total[GLOW + k] += ray.weight * shine.glow[k]


@spliced
def _ask_lights(
    ray: EyeRay, met: Met, facing: float, cover: float, both: bool, studio: Scene, rays: Rays, count: int
) -> int:
    """Request rays from a place to the lights; `facing` is how far it faces the key light.

    Samples take turns: once averaged, half of them are plenty for either light. Some ask for both.
    """
    aim, origin = studio.pattern[ray.aim], _above_smooth(met)
    if facing > 0.0 and (both or ray.aim % 2 == 0):
        ray.total[KEY_ASKED] += cover
        count = _ask(rays, count, origin, _vector(aim), FAR, ray.slot + KEY_ARRIVED, cover)
    if both or ray.aim % 2 == 1:
        ray.total[SKY_ASKED] += cover
        to_sky = _turned(_vector(aim[3:]), met.normal)
        count = _ask(rays, count, origin, to_sky, REACH, ray.slot + SKY_ARRIVED, cover)
    return count


@kernel
def shade(
    seen: EyeRays,
    mesh: RayMesh,
    pyramid: MipPyramid,
    maps: SurfaceMaps,
    studio: Scene,
    sums: Single,
    rays: Rays,
) -> int:
    """Add the light along each ray to its pixel's sums, and list the occlusion rays that it needs.

    Parameters
    ----------
    seen
        Hits of rays from the eye; `through` and `onward` get the light that continues after a hit.
    mesh, pyramid, maps, studio
        The model, its material, and how they are seen.
    sums
        (pixels, SUMS): updated.
    rays
        Room for two rays per hit: filled.

    Returns
    -------
    int
        Number of occlusion rays.

    References
    ----------
    J. Hanika: Hacking the Shadow Terminator, Ray Tracing Gems II, 2021 (where occlusion rays start).
    """
    eye, key, occlusion, count = _vector(studio.eye), _vector(studio.key), len(studio.pattern) > 0, 0
    for i in range(len(seen.hit)):
        d, pixel, total = _row(seen.directions, i), seen.pixels[i], sums[seen.pixels[i]]
        weight = np.float64(seen.through[i])
        ray = EyeRay(d, math.sqrt(_dot(d, d)), weight, total, pixel * SUMS, seen.aims[i])
        seen.through[i] = 0.0
        if seen.hit[i] < 0:
            if occlusion:
                count = _floor_light(ray, studio, rays, count)
            continue

        i0, i1, i2 = mesh.triangles[seen.hit[i]]
        met = _met(mesh, (i0, i1, i2), np.float64(seen.u[i]), np.float64(seen.v[i]), d)
        toward_eye = _scaled(d, -1.0 / ray.length)
        depth = _dot(_along(met.place, -1.0, eye), d) / (ray.length * ray.length)
        shown = _look_up(mesh, pyramid, (i0, i1, i2), met, studio, ray, depth)
        color, cover = shown.color, weight * shown.color[3]
        seen.through[i] = weight * (1.0 - color[3])
        seen.onward[i, 0], seen.onward[i, 1], seen.onward[i, 2] = _along(met.place, -LIFT, toward_eye)
        if cover <= 0.0:
            continue
        light = _light(met.normal, toward_eye, key)
        if maps.used:
            _add_material(ray, maps, (i0, i1, i2), met, shown, toward_eye, key)
        else:
            for k in range(3):
                share = weight * color[k]
                total[AMBIENT + k] += share * light.ambient + cover * light.sheen
                total[KEY + k] += share * KEY_LIGHT * light.key + cover * light.glint
        for k in range(3):
            total[NORMAL + k] += cover * met.normal[k]
        # A pixel's first sample asks for both lights, so that every pixel has an answer of its own.
        both = total[COVER] == 0.0 or studio.samples == 1
        total[COVER] += cover
        if color[3] >= 0.5:
            total[DEPTH] = min(total[DEPTH], depth)
        if occlusion:
            count = _ask_lights(ray, met, light.key, cover, both, studio, rays, count)
    return count


@inline
def _share(lights: Single, y: int, x: int, asked: int, arrived: int) -> float:
    """Return the share of a light that arrives; all of it if no rays were sent."""
    return (
        lights[arrived - LIGHT, y, x] / lights[asked - LIGHT, y, x]
        if lights[asked - LIGHT, y, x] > 0.0
        else 1.0
    )


@kernel
def resolve(
    sums: Single, lights: Single, start: int, studio: Scene, background: Single, image: Single
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
        (height, 3): one colour per row of the image; (0, 3) makes it transparent.
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
                image[y, x, k] = (total[AMBIENT + k] * sky + total[KEY + k] * key + total[GLOW + k]) * share
                brightest = max(brightest, image[y, x, k])
            if brightest > KNEE * cover and cover > 0.0:
                over = (brightest / cover - KNEE) / (1.0 - KNEE)
                fitted = cover * (1.0 - (1.0 - KNEE) * math.exp(-over))
                pale = 0.0
                if studio.pales:
                    pale = 1.0 - math.exp(-max(brightest / cover - PALE, 0.0) / PALE_RANGE)
                for k in range(3):
                    image[y, x, k] = fitted * (pale + (1.0 - pale) * image[y, x, k] / brightest)
            rest = max(1.0 - cover - shadow, 0.0)
            if len(background) > 0:
                for k in range(3):
                    image[y, x, k] += rest * background[y, k]
            else:
                image[y, x, 3] = 1.0 - rest
                if rest < 1.0:
                    for k in range(3):
                        image[y, x, k] /= 1.0 - rest
