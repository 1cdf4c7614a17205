"""Figure of a material: all its maps by one quilt, lit from either side."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars
from upholster import paint_material, read_material, synthesize
from upholster.charts.seams import find_seams
from upholster.geometry import Surface, torus
from upholster.image import from_linear, to_linear
from upholster.model import build_atlas, face_parameters, tessellate
from upholster.quilt import Texels
from upholster.render import Camera, render
from upholster.types import FloatArray

__all__ = ["material"]

SIZE, VIEW = (640, 500), (30.0, 38.0)


def material(_exemplars: Exemplars) -> Any:
    """Cover a torus with the project's own material, and light it from the left and from the right."""
    surface = torus(2.0, 0.9)
    chosen = read_material(OWN / "bricks_material")
    quilt = synthesize(chosen, surface, texels=2_000_000, sample_size=2.5, direction="around:z", seed=1)
    maps = paint_material(quilt, chosen)
    camera = Camera.fit(tessellate(surface).positions, size=SIZE, view=VIEW)
    right, up, forward = camera.axes
    panels = []
    for side, title in ((-1.0, "(a) light from the left"), (1.0, "(b) light from the right")):
        light = side * 0.9 * right + 0.35 * up - 0.3 * forward
        lit = [
            _lit(surface, maps, n, light / np.linalg.norm(light), camera.eye)
            for n in range(len(quilt.charts))
        ]
        picture = _shown(surface, Texels(quilt.charts, tuple(lit)), camera)
        panels.append(Panel(Image.fromarray(from_linear(picture, np.uint8, dither=True)), title))
    return compose([panels], gap=14)


def _shown(surface: Surface, texels: Texels, camera: Camera) -> FloatArray:
    """Take a picture of texels in linear light as they are: what the studio's lights do is divided out."""
    seams = find_seams(surface, texels.charts)
    mesh = tessellate(surface, texels.charts, seams)
    atlas = build_atlas(texels, seams)
    uv, grey = atlas.texture_coordinates(mesh), np.full((1, 1, 3), 0.4, np.float32)
    # Half as bright, so that no highlight is compressed.
    colored, plain = (
        render(
            mesh.positions, mesh.normals, uv, mesh.all_triangles(), texture,
            camera=camera, supersample=3, background=None, shadows=False,
        )
        for texture in (0.4 * atlas.pixels, grey)
    )  # fmt: skip
    ratio = colored[:, :, :3] / np.maximum(plain[:, :, :3], 1e-4)
    share = colored[:, :, 3:]
    return np.asarray(np.clip(ratio, 0, 1) * share + 0.8 * (1 - share))


def _lit(
    surface: Surface, maps: Mapping[str, Texels], number: int, light: FloatArray, eye: FloatArray
) -> Any:
    """Return a chart's texels in linear light: Lambert's law and a Blinn highlight under one distant lamp."""
    chart = maps["albedo"].charts[number]
    rows, columns = (np.arange(side, dtype=np.float64) + 0.5 for side in (chart.height, chart.width))
    s, t = face_parameters(chart, rows, columns)
    points, down, tangent = surface.faces[chart.face].derivatives_grid(s, t)
    outward = _unit(np.cross(down, tangent))
    tangent = _unit(tangent)
    plain = {role: maps[role].arrays[number] / 255.0 for role in ("normal", "roughness", "ao")}
    x, y, z = np.moveaxis(2 * plain["normal"] - 1, 2, 0)[..., None]
    normal = _unit(x * tangent + y * np.cross(outward, tangent) + z * outward)
    halfway = _unit(light + _unit(eye - points))
    # Where the surface itself turns away, bumps catch no light.
    shown = np.clip(4 * (outward @ light), 0, 1)
    straight = shown * np.clip(normal @ light, 0, 1)
    power = 2 / np.maximum(plain["roughness"][..., 0], 0.1) ** 4
    gleam = 0.0015 * (power + 8) * straight * np.clip((normal * halfway).sum(axis=2), 0, 1) ** power
    albedo = to_linear(maps["albedo"].arrays[number])
    lamp = (0.26 * plain["ao"][..., 0] + 1.25 * straight)[..., None]
    return np.asarray(albedo * lamp + gleam[..., None], np.float32)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
