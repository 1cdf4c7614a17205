"""Figure of a material: its base colour alone, all its maps by one quilt, and the same wall of metal."""

from typing import Any

import numpy as np
from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars
from upholster import WriteOptions, paint_material, read_material, synthesize
from upholster.geometry.built_in.cyclide import torus
from upholster.image.color import from_linear
from upholster.model.textured_model import TexturedModel
from upholster.quilt.model import Texels

__all__ = ["material"]

_OPTIONS = WriteOptions(size=(560, 440), view=(30.0, 38.0), supersample=3)
_GOLD = (255, 196, 90)


def material(_exemplars: Exemplars) -> Any:
    """Cover a torus with the project's own material, and show it without and with its maps."""
    surface = torus(2.0, 0.9)
    chosen = read_material(OWN / "bricks_material")
    quilt = synthesize(chosen, surface, texels=2_000_000, sample_size=2.5, direction="around:z", seed=1)
    maps = paint_material(quilt, chosen)
    color = maps.pop("albedo")

    def filled(value: int | tuple[int, ...]) -> Texels:
        values = np.atleast_1d(np.array(value, np.uint8))
        shapes = [(*array.shape[:2], len(values)) for array in color.arrays]
        return Texels(color.charts, tuple(np.broadcast_to(values, shape).copy() for shape in shapes))

    metal = maps | {"metallic": filled(255), "roughness": filled(90)}
    panels = [
        Panel(_picture(TexturedModel(surface, base, _OPTIONS, maps=shown)), title)
        for base, shown, title in (
            (color, {}, "(a) base colour alone"),
            (color, maps, "(b) all maps"),
            (filled(_GOLD), metal, "(c) the same wall of gold"),
        )
    ]
    return compose([panels], gap=14)


def _picture(model: TexturedModel) -> Any:
    return Image.fromarray(from_linear(model.picture(), np.uint8, dither=True))
