"""Several textured pieces of one mesh as one model: their charts together, with the maps of all of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from upholster.base.types import PixelArray
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.color import alpha_channel, to_linear
from upholster.image.numbers import as_depth, top_of
from upholster.image.roles import COLORS, MAP_ROLES, ROLES
from upholster.model.textured_model import TexturedModel
from upholster.quilt.model import Texels

__all__ = ["joined_model", "joined_surface"]


def joined_model(models: Sequence[TexturedModel]) -> TexturedModel:
    """Return several models as one, which has them as its parts; a single one is returned unchanged.

    Parameters
    ----------
    models
        Models on one mesh, with the same options; no triangle is on islands of two models. Colours get the
        greatest depth and the most channels of all; a map that a model lacks is neutral there.
    """
    first = models[0]
    if len(models) == 1:
        return first
    roles = [role for role in ROLES[1:] if any(role in model.maps for model in models)]
    maps = {role: _joined_texels(models, role) for role in roles}
    return replace(
        first,
        surface=joined_surface([model.surface for model in models]),
        texels=_joined_texels(models, "albedo"),
        maps=maps,
        quilt=None,
        exemplar=None,
        notes=[],
        name="",
        parts=tuple(models),
    )


def joined_surface(surfaces: Sequence[AnySurface]) -> AnySurface:
    """Return one mesh with the islands of several, one surface's after the other's; a single one unchanged.

    Parameters
    ----------
    surfaces
        Surfaces of one mesh; no triangle is on islands of two surfaces.
    """
    if len(surfaces) == 1:
        return surfaces[0]
    meshes = [surface for surface in surfaces if isinstance(surface, MeshSurface)]
    island, parameters = meshes[0].island.copy(), meshes[0].parameters.copy()
    count = meshes[0].islands
    for surface in meshes[1:]:
        laid = surface.island >= 0
        island[laid], parameters[laid] = surface.island[laid] + count, surface.parameters[laid]
        count += surface.islands
    return MeshSurface(meshes[0].mesh, island, parameters)


def _joined_texels(models: Sequence[TexturedModel], role: str) -> Texels:
    """Return the texels of one map over all models, with one depth and number of channels."""
    own = [model.texels if role == "albedo" else model.maps.get(role) for model in models]
    samples = [texels.arrays[0] for texels in own if texels is not None]
    dtype = np.result_type(*(sample.dtype for sample in samples))
    channels = _most_channels([sample.shape[2] for sample in samples])
    charts, arrays, count = [], [], 0
    for model, texels in zip(models, own, strict=True):
        charts += [replace(chart, face=chart.face + count) for chart in model.texels.charts]
        count = len(charts)
        if texels is not None:
            arrays += [_as(array, role, dtype, channels) for array in texels.arrays]
        else:
            # Without heights a material is not displaced.
            absent = (0.0,) if role == "height" else MAP_ROLES[role].neutral
            neutral = np.resize(absent, channels) * top_of(dtype)
            neutral = neutral if dtype.kind == "f" else np.rint(neutral)
            arrays += [
                np.full((chart.height, chart.width, channels), neutral, dtype)
                for chart in model.texels.charts
            ]
    return Texels(tuple(charts), tuple(arrays))


def _most_channels(counts: Sequence[int]) -> int:
    """Return a number of channels that suits all: colour if one has it, alpha if one has it."""
    alpha = any(alpha_channel(count) is not None for count in counts)
    return (3 if max(counts) >= 3 else 1) + alpha


def _as(pixels: PixelArray, role: str, dtype: np.dtype[np.generic], channels: int) -> PixelArray:
    """Return pixels in a depth that can hold theirs, and with channels added."""
    if pixels.dtype != dtype:
        linear = role in COLORS and dtype.kind == "f"
        pixels = to_linear(pixels) if linear else as_depth(pixels, dtype)
    alpha = alpha_channel(pixels.shape[2])
    color = pixels if alpha is None else pixels[:, :, :alpha]
    parts = [np.repeat(color, 3, axis=2) if channels >= 3 and color.shape[2] == 1 else color]
    if alpha_channel(channels) is not None:
        shape = (*pixels.shape[:2], 1)
        parts.append(np.full(shape, top_of(dtype), dtype) if alpha is None else pixels[:, :, alpha:])
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)
