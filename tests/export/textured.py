"""Small textured models for the tests of every exporter."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from upholster.base.types import FloatArray, PixelArray
from upholster.charts.chart_seams import find_seams
from upholster.charts.layout import uniform_layout
from upholster.charts.tessellation.mesh import Mesh, tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.surface import Surface
from upholster.image.color import to_linear
from upholster.model.atlas import Atlas, build_atlas
from upholster.quilt.model import Texels


@dataclass
class Model:
    surface: Surface
    mesh: Mesh
    texels: Texels
    atlas: Atlas
    uv: FloatArray

    @property
    def pixels(self) -> PixelArray:
        return self.atlas.pixels


def make_model(
    kind: str = "cyclide", channels: int = 3, dtype: Any = np.uint8, alpha: str = "opaque", size: int = 32
) -> Model:
    """A small textured model; `alpha`: opaque, mask or blend."""
    surface = {"cyclide": ring_cyclide, "octants": lambda: sphere(tiling="octants"), "sphere": sphere}[kind]()
    rows, columns = np.mgrid[0:size, 0:size]
    planes = [(rows * (k + 2) + columns * (5 - k)) % 256 for k in range(channels)]
    if channels in (2, 4):
        planes[-1] = {"opaque": rows * 0 + 255, "mask": rows * 2 // size * 255, "blend": rows * 255 // size}[
            alpha
        ]
    image: PixelArray = np.stack(planes, axis=2).astype(np.uint8)
    if dtype == np.uint16:
        image = image * np.uint16(257)
    elif dtype == np.float32:
        image = to_linear(image)
    charts = uniform_layout(surface, chart=size)
    seams = find_seams(surface, charts)
    texels = Texels(charts, (image,) * len(charts))
    atlas = build_atlas(texels, seams)
    mesh = tessellate(surface, charts, seams, quads=400)
    return Model(surface, mesh, texels, atlas, atlas.texture_coordinates(mesh))
