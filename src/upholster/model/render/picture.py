"""Pictures of a textured model: ray casting with Embree, band by band, on any machine, without a display."""

import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.model.render._kernels import DEPTH, LIGHT, SUMS, EyeRays, RayMesh, Rays, Scene, resolve, shade
from upholster.model.render._material_kernels import SurfaceMaps
from upholster.model.render.camera import Camera
from upholster.model.render.checks import Color, check_numbers, checked_background, checked_model
from upholster.model.render.light import MARGIN, TILE, averaged, key_direction, occlusion_pattern
from upholster.model.render.material_maps import build_maps, checked_maps
from upholster.model.render.texture import MipPyramid, build_mip_pyramid, checked_texture
from upholster.runtime.parallel import run_tasks

__all__ = ["STUDIO_BACKGROUND", "render"]

STUDIO_BACKGROUND = ((0.80, 0.81, 0.82), (0.92, 0.92, 0.91))
"""Linear colours of the default background at the top and at the bottom."""

_BATCH_RAYS = 1 << 17
_BAND_ROWS = 96
_LAYERS = 16
_DARK = 1 / 512


def render(
    positions: ArrayLike,
    normals: ArrayLike,
    uv: ArrayLike,
    triangles: ArrayLike,
    texture: PixelArray | None,
    *,
    maps: Mapping[str, PixelArray] | None = None,
    tangents: ArrayLike | None = None,
    normal_scale: float = 1.0,
    size: tuple[int, int] = (1024, 768),
    view: tuple[float, float] = (30.0, 30.0),
    zoom: float = 1.0,
    target: ArrayLike | None = None,
    camera: Camera | None = None,
    supersample: int = 2,
    background: Color | tuple[Color, Color] | None = STUDIO_BACKGROUND,
    shadows: bool = True,
    floor: bool = True,
    max_level: int = 4,
    depth: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Take a picture of a textured model; progress has the stage "render".

    Parameters
    ----------
    positions
        (V, 3): vertices in model units; z is up.
    normals
        (V, 3): outward normals of any length; a zero normal is replaced by that of the triangle.
    uv
        (V, 2): texture coordinates, u right and v down, 0 to 1 over the texture; clamped to it.
    triangles
        (N, 3): vertices of each triangle. Both sides are shown.
    texture
        (H, W, C) uint8 or uint16, sRGB-coded, or float32, linear: grey, grey and alpha, RGB, or RGB and
        alpha. None shows the bare shape. Where alpha is below 1, surfaces behind show through, up to 16
        layers; for occlusion the surface counts as solid.
    maps
        A material's other maps by role, each of the texture's height and width and in the form of
        `upholster.image.files.material.Material`: normal, roughness, metallic, ao and emission are shown,
        under the light of `upholster.model.render.environment`. Other maps are ignored.
    tangents
        (V, 3): the direction of a normal map's x, of any length; y points along normal × tangent.
    normal_scale
        Factor for x and y of normals.
    size
        (width, height) in pixels, 1 to 16384 each.
    view, zoom, target
        The camera's placement: see `Camera.fit`, which gets all vertices.
    camera
        The camera itself, instead of the four above.
    supersample
        1 to 8: samples per pixel each way.
    background
        Linear colour; or two, for top and bottom; or None for a transparent picture.
    shadows
        Whether the model casts shadows and blocks sky light, on itself and on the floor.
    floor
        Whether the model is on a floor that shows nothing but the shadow; not seen from below.
    max_level
        0 to 12: coarsest mip level used, so that an atlas with gutters of 2^max_level texels never bleeds.
    depth
        (h, w) float32: filled with the depth of each pixel's nearest sample that is solid (alpha ≥ ½), in
        model units along the viewing direction, as `Camera.project` gives it; infinite where there is none.

    Returns
    -------
    ndarray
        (h, w, 3) float32, linear light, 0 to 1; or, if `background` is None, (h, w, 4) with alpha, not
        premultiplied.

    Raises
    ------
    InputError
        An argument has the wrong shape, is out of range or is not finite.

    Notes
    -----
    A surface that faces the key light has about the texture's own colour; most visible surfaces have 0.7
    to 1 of it. Light above 0.9 is compressed toward 1 at constant hue; lamps that a material mirrors turn
    white. Samples are on a rotated grid inside each pixel and are averaged with equal weights.

    References
    ----------
    I. Wald et al.: Embree, SIGGRAPH 2014. Texture: see `build_mip_pyramid`. Light: see
    `upholster.model.render.light`.
    """
    space, normals, uv, triangles = checked_model(positions, normals, uv, triangles)
    if texture is not None:
        texture = checked_texture(texture)
    if camera is None:
        camera = Camera.fit(space, size=size, view=view, zoom=zoom, target=target)
    width, height = camera.size
    check_numbers(supersample, max_level, depth, (height, width))
    shown, along = checked_maps(maps, texture, tangents, len(space))
    rows = checked_background(background, height)
    middle, radius = _sphere(space)
    mesh = RayMesh(triangles, ((space - middle) / radius).astype(np.float32), normals, uv)
    ground = float(mesh.positions[:, 2].min()) if floor and shadows else -math.inf
    studio = Scene(
        eye=(camera.eye - middle) / radius,
        right=camera.axes[0].copy(),
        up=camera.axes[1].copy(),
        key=key_direction(camera.axes),
        floor=ground,
        spread=1 / (camera.focal * supersample),
        pattern=occlusion_pattern(camera.axes, supersample)[: None if shadows else 0],
        samples=supersample**2,
        pales=bool(shown),
    )
    finest = 0
    if texture is not None:
        finest = _finest_level(mesh, camera, studio, *texture.shape[:2])
    first = min(finest, max_level)
    pyramid = build_mip_pyramid(texture, first=first, last=max_level)
    others = build_maps(shown, along, camera.axes, normal_scale=normal_scale, first=first, last=max_level)
    image = np.empty((height, width, 4 if background is None else 3), np.float32)
    work = _Work(mesh, pyramid, others, studio, camera, rows, image, depth)
    work.paint()
    if depth is not None:
        depth *= radius
    return image


def _sphere(positions: FloatArray) -> tuple[FloatArray, float]:
    """Return the middle of a model and its radius: in radii, single precision is enough for any model."""
    lowest, highest = positions.min(axis=0), positions.max(axis=0)
    middle, extent = lowest + (highest - lowest) / 2, float((highest - lowest).max())
    return middle, extent * float(np.sqrt((((positions - middle) / extent) ** 2).sum(axis=1).max()))


class _Work:
    """One picture in progress: the data that its bands share."""

    def __init__(
        self,
        mesh: RayMesh,
        pyramid: MipPyramid,
        maps: SurfaceMaps,
        studio: Scene,
        camera: Camera,
        background: NDArray[np.float32],
        image: NDArray[np.float32],
        depth: NDArray[np.float32] | None,
    ) -> None:
        self.mesh, self.pyramid, self.maps, self.studio, self.camera = mesh, pyramid, maps, studio, camera
        self.background, self.image, self.depth = background, image, depth
        self.supersample = math.isqrt(studio.samples)
        self.occlusion = len(studio.pattern) > 0
        # Set when the picture is abandoned, so that running bands end at once.
        self.stopped = False
        self.scene = EmbreeScene()
        self.geometry = TriangleMesh(self.scene, mesh.positions, mesh.triangles)
        # The first query builds the tree, in one thread only.
        self.scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="OCCLUDED")

    def paint(self) -> None:
        """Fill the picture, band by band."""
        height = len(self.image)
        tasks: list[Callable[[], object]] = [
            partial(self.paint_band, top, min(top + _BAND_ROWS, height))
            for top in range(0, height, _BAND_ROWS)
        ]
        try:
            run_tasks(tasks, stage="render")
        except BaseException:
            self.stopped = True
            raise

    def paint_band(self, top: int, bottom: int) -> None:
        """Fill rows `top` to `bottom` of the picture."""
        height, width = self.image.shape[:2]
        margin = MARGIN if self.occlusion else 0
        start, stop = max(top - margin, 0), min(bottom + margin, height)
        sums = np.zeros((stop - start, width, SUMS), np.float32)
        sums[..., DEPTH] = math.inf
        columns = min(width, _BATCH_RAYS // self.studio.samples)
        step = max(1, _BATCH_RAYS // (columns * self.studio.samples))
        for row in range(start, stop, step):
            for column in range(0, width, columns):
                if self.stopped:
                    return
                right = min(column + columns, width)
                self._trace(np.arange(row, min(row + step, stop)), np.arange(column, right), start, sums)
        if self.occlusion:
            lights = averaged(sums, self.studio.spread * self.supersample)
        else:
            lights = np.zeros((SUMS - LIGHT, *sums.shape[:2]), np.float32)
        inner = slice(top - start, bottom - start)
        rows = self.background[top:bottom]
        resolve(sums, lights, inner.start, self.studio, rows, self.image[top:bottom])
        if self.depth is not None:
            self.depth[top:bottom] = sums[inner, :, DEPTH]

    def _trace(
        self, rows: NDArray[np.int_], columns: NDArray[np.int_], start: int, sums: NDArray[np.float32]
    ) -> None:
        """Add a rectangle of pixels to the sums, whose first row is row `start` of the picture."""
        samples = np.arange(self.studio.samples)
        directions = self._directions(rows, columns)
        origins = np.broadcast_to(self.studio.eye.astype(np.float32), directions.shape)
        places = (rows[:, None, None] - start) * sums.shape[1] + columns[:, None]
        pixels = np.repeat(places.reshape(-1), len(samples))
        tile = (rows[:, None, None] % TILE * TILE + columns[:, None] % TILE) * len(samples)
        aims = (tile + samples).astype(np.int32).reshape(-1)
        through = np.ones(len(directions), np.float32)
        flat_sums = sums.reshape(-1, SUMS)
        for _ in range(_LAYERS):
            hits = self.scene.run(origins, directions, query="INTERSECT", output=1)
            onward = np.empty(directions.shape, np.float32)
            rays = _room(2 * len(directions) if self.occlusion else 0)
            seen = EyeRays(hits["primID"], hits["u"], hits["v"], directions, pixels, aims, through, onward)
            asked = shade(seen, self.mesh, self.pyramid, self.maps, self.studio, flat_sums, rays)
            if asked:
                met = self.scene.run(
                    rays.origins[:asked], rays.directions[:asked], query="OCCLUDED", dists=rays.reach[:asked]
                )
                free = met < 0
                np.add.at(sums.reshape(-1), rays.slots[:asked][free], rays.weights[:asked][free])
            alive = through > _DARK
            if not self.pyramid.see_through or not alive.any():
                break
            origins, directions, through = onward[alive], directions[alive], through[alive]
            pixels, aims = pixels[alive], aims[alive]

    def _directions(self, rows: NDArray[np.int_], columns: NDArray[np.int_]) -> NDArray[np.float32]:
        """Return the (n, 3) directions of pixels' rays: per pixel supersample² of them, on a rotated grid."""
        n = self.supersample
        i, j = np.divmod(np.arange(n * n), n)
        x = columns[:, None] + (i + (j + 0.5) / n) / n
        y = rows[:, None, None] + (j + (n - 0.5 - i) / n) / n
        # Directions are linear in x and y: two small sums instead of three products per ray.
        right, up, forward = self.camera.axes
        across = ((x - self.camera.size[0] / 2) / self.camera.focal)[..., None] * right
        down = ((y - self.camera.size[1] / 2) / self.camera.focal)[..., None] * up
        result = np.empty((len(rows), len(columns), n * n, 3), np.float32)
        np.subtract((across + forward).astype(np.float32), down.astype(np.float32), out=result)
        return result.reshape(-1, 3)


def _room(count: int) -> Rays:
    """Return empty arrays for occlusion rays."""
    return Rays(
        np.empty((count, 3), np.float32),
        np.empty((count, 3), np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.int64),
        np.empty(count, np.float32),
    )


def _finest_level(mesh: RayMesh, camera: Camera, studio: Scene, height: int, width: int) -> int:
    """Return the finest mip level that the picture can need: finer ones are not computed."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    nearest = float(((corners - studio.eye) @ camera.axes[2]).min())
    if nearest <= 0:
        return 0
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    aa, bb, ab = (one**2).sum(axis=1), (two**2).sum(axis=1), (one * two).sum(axis=1)
    area = aa * bb - ab * ab
    places = mesh.uv[mesh.triangles].astype(np.float64) * (width, height)
    (ua, va), (ub, vb) = (places[:, 1] - places[:, 0]).T, (places[:, 2] - places[:, 0]).T
    # The least eigenvalue of U·(EᵀE)⁻¹·Uᵀ (E: a triangle's edges in space, U: in texels) is the square of its
    # least density.
    with np.errstate(divide="ignore", invalid="ignore"):
        trace = (bb * (ua**2 + va**2) - 2 * ab * (ua * ub + va * vb) + aa * (ub**2 + vb**2)) / area
        least = trace / 2 - np.sqrt(np.maximum((trace / 2) ** 2 - (ua * vb - ub * va) ** 2 / area, 0))
    seen = (area > 0) & (least > 0)
    if not seen.any():
        return 0
    return max(0, math.floor(math.log2(nearest * studio.spread * math.sqrt(float(least[seen].min())))))
