"""A material's maps prepared for look-up: everything that pictures show except the base colour."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, PixelArray
from upholster.image.color import to_linear
from upholster.image.numbers import to_unit
from upholster.image.roles import MAP_ROLES
from upholster.model.render._material_kernels import SurfaceMaps
from upholster.model.render.environment import lamps
from upholster.model.render.texture import MipPyramid, averaged_down, build_mip_pyramid

__all__ = ["SHOWN", "build_maps", "checked_maps"]

SHOWN = tuple(role.name for role in MAP_ROLES.values() if role.gltf and role.name != "albedo")
"""Roles that pictures show, besides base colour and opacity."""

_SURFACE = ("roughness", "metallic")


def checked_maps(
    maps: Mapping[str, PixelArray] | None,
    texture: PixelArray | None,
    tangents: ArrayLike | None,
    vertices: int,
) -> tuple[dict[str, PixelArray], NDArray[np.float32]]:
    """Return the shown maps, and tangents, (0, 3) without a normal map; or raise `InputError`."""
    shown = {role: part for role, part in (maps or {}).items() if role in SHOWN}
    for role, part in shown.items():
        channels = MAP_ROLES[role].channels
        shape = None if texture is None else texture.shape[:2]
        if part.ndim != 3 or part.shape[2] not in channels or part.shape[:2] != shape:
            raise InputError(
                f"{role} map has shape {part.shape}; allowed: (height, width, {channels[-1]}), as the texture"
            )
    if "normal" not in shown:
        return shown, np.empty((0, 3), np.float32)
    along = np.array([] if tangents is None else tangents, np.float32, order="C")
    if along.shape != (vertices, 3) or not np.isfinite(along).all():
        raise InputError(
            f"tangents have shape {along.shape}; with a normal map allowed: ({vertices}, 3), finite"
        )
    return shown, along


def build_maps(
    maps: Mapping[str, PixelArray],
    tangents: NDArray[np.float32],
    axes: FloatArray,
    *,
    normal_scale: float = 1.0,
    first: int,
    last: int,
) -> SurfaceMaps:
    """Average a material's maps down, and compute the lamps for a camera's axes (rows: right, up, forward).

    Parameters
    ----------
    maps, tangents
        As `checked_maps` returns them.
    axes, normal_scale
        See `SurfaceMaps`.
    first, last
        As for `upholster.model.render.texture.build_mip_pyramid`.
    """
    none = build_mip_pyramid(None)
    detail = glow = none

    def pyramid(work: "partial[NDArray[np.float32]]", parts: Mapping[str, PixelArray]) -> MipPyramid:
        height, width = next(iter(parts.values())).shape[:2]
        return averaged_down(work, height, width, first=first, last=last)

    if maps:
        detail = pyramid(partial(_detail_rows, maps), maps)
    glows = bool(maps.keys() & {"ao", "emission"})
    if glows:
        glow = pyramid(partial(_glow_rows, maps), maps)
    return SurfaceMaps(bool(maps), detail, glow, glows, tangents, float(normal_scale), lamps(axes))


def _detail_rows(maps: Mapping[str, PixelArray], row: int, stop: int) -> NDArray[np.float32]:
    """Return x and y of normals, roughness and metal in rows of the maps; defaults are those of GLB."""
    width = next(iter(maps.values())).shape[1]
    block = np.empty((stop - row, width, 4), np.float32)
    block[:] = *MAP_ROLES["normal"].neutral[:2], *(MAP_ROLES[role].neutral[0] for role in _SURFACE)
    if "normal" in maps:
        block[..., :2] = to_unit(maps["normal"][row:stop, :, :2])
    for k, role in enumerate(_SURFACE):
        if role in maps:
            block[..., 2 + k] = to_unit(maps[role][row:stop, :, 0])
    return block


def _glow_rows(maps: Mapping[str, PixelArray], row: int, stop: int) -> NDArray[np.float32]:
    """Return emission, linear, and occlusion in rows of the maps."""
    width = next(iter(maps.values())).shape[1]
    block = np.zeros((stop - row, width, 4), np.float32)
    block[..., 3] = MAP_ROLES["ao"].neutral[0]
    if "emission" in maps:
        block[..., :3] = to_linear(maps["emission"][row:stop])
    if "ao" in maps:
        block[..., 3] = to_unit(maps["ao"][row:stop, :, 0])
    return block
