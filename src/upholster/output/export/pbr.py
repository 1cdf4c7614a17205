"""glTF's material: base colour, normals, occlusion–roughness–metallic in one image, emission."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from upholster.base.errors import InputError, nearest
from upholster.base.options.write_options import TextureFormat
from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel
from upholster.image.files.write import ImageFormat, encode_image
from upholster.image.roles import DEFAULT_ROUGHNESS, MAP_ROLES, ROLES

__all__ = ["PbrMaterial", "TextureFormat", "alpha_mode", "build_material"]

DATA_QUALITY = 90
"""Least quality of JPEG and WebP for maps other than colours: from here on JPEG keeps its full colour."""

_PACKED = {role.name for role in MAP_ROLES.values() if role.gltf and role.channel is not None}
"""Roles that share one image."""


@dataclass
class PbrMaterial:
    """A material in glTF's terms.

    Attributes
    ----------
    document
        The object that goes into ``materials``.
    images
        Names and files, in the order of their texture indices.
    """

    document: dict[str, Any]
    images: list[tuple[str, bytes]] = field(default_factory=list)


def build_material(
    pixels: PixelArray,
    maps: Mapping[str, PixelArray],
    *,
    texture: TextureFormat,
    quality: int,
    normal_scale: float,
    name: str,
    mode: str,
    first: int = 0,
) -> PbrMaterial:
    """Encode a material's images, and describe it.

    Parameters
    ----------
    pixels
        (H, W, C) of the base colour.
    maps
        Other maps by role, (H, W, 1) or (H, W, 3), see `upholster.image.files.material.Material`; height and
        opacity, which glTF does not support, are left out.
    texture, quality, normal_scale, name
        As for `write_glb`.
    mode
        Use of alpha: see `alpha_mode`.
    first
        Index of the first of the material's textures in the file.

    Raises
    ------
    InputError
        For an unknown role or format, a shape that does not fit, or alpha in a JPEG.
    """
    if texture not in get_args(TextureFormat):
        raise InputError(f"texture {texture!r} is unknown; {nearest(str(texture), get_args(TextureFormat))}")
    # By default, data is not JPEG: its effect on normals is visible in highlights.
    data: ImageFormat = "png" if texture == "auto" else texture
    colours: ImageFormat = "jpeg" if texture == "auto" and mode == "OPAQUE" else data
    for role, part in maps.items():
        _check_map(role, part)
    if mode == "OPAQUE" and alpha_channel(pixels.shape[2]) is not None:
        pixels = pixels[:, :, :-1]
    elif mode != "OPAQUE" and texture == "jpeg":
        raise InputError("texture 'jpeg' cannot hold the sample's alpha; allowed: 'png' or 'webp'")
    surface: dict[str, Any] = {
        MAP_ROLES["albedo"].gltf: {"index": first},
        "metallicFactor": 1 if "metallic" in maps else 0,
        "roughnessFactor": 1 if "roughness" in maps else DEFAULT_ROUGHNESS,
    }
    document: dict[str, Any] = {
        "name": name,
        "pbrMetallicRoughness": surface,
        "doubleSided": True,  # open surfaces have a back, too
    }
    if mode != "OPAQUE":
        document["alphaMode"] = mode
    made = PbrMaterial(document, [(name, encode_image(pixels, colours, quality=quality))])

    def add(kind: str, image: PixelArray, least: int) -> dict[str, Any]:
        coded = encode_image(image, data if least > 1 else colours, quality=max(quality, least))
        made.images.append((f"{name} {kind}", coded))
        return {"index": first + len(made.images) - 1}

    if "normal" in maps:
        scale = {} if normal_scale == 1 else {"scale": normal_scale}
        document[MAP_ROLES["normal"].gltf] = add("normal", _data(maps["normal"]), DATA_QUALITY) | scale
    if maps.keys() & _PACKED:
        packed = add("occlusion-roughness-metallic", _packed(maps), DATA_QUALITY)
        if "ao" in maps:
            document[MAP_ROLES["ao"].gltf] = packed
        if maps.keys() & {"roughness", "metallic"}:
            surface[MAP_ROLES["roughness"].gltf] = packed
    if "emission" in maps:
        document[MAP_ROLES["emission"].gltf] = add("emission", maps["emission"], 1)
        document["emissiveFactor"] = [1, 1, 1]
    return made


def _check_map(role: str, part: PixelArray) -> None:
    if role not in ROLES[1:]:
        raise InputError(f"role {role!r} is unknown; {nearest(role, ROLES[1:])}")
    channels = MAP_ROLES[role].channels
    if part.ndim != 3 or part.shape[2] not in channels:
        raise InputError(f"{role} map has shape {part.shape}; allowed: (H, W, {channels[-1]})")


def _packed(maps: Mapping[str, PixelArray]) -> PixelArray:
    """Return red: occlusion, green: roughness, blue: metallic; 1 for missing maps, so that factors decide."""
    parts = {role: _data(maps[role]) for role in maps.keys() & _PACKED}
    shape, *others = {part.shape for part in parts.values()}
    if others:
        raise InputError("ao, roughness and metallic maps differ in size; allowed: one size")
    wide = any(part.dtype == np.uint16 for part in parts.values())
    packed = np.full((*shape[:2], 3), 65535 if wide else 255, np.uint16 if wide else np.uint8)
    for role, part in parts.items():
        scale = np.uint16(257 if wide and part.dtype == np.uint8 else 1)
        packed[:, :, MAP_ROLES[role].channel] = part[:, :, 0] * scale
    return packed


def _data(pixels: PixelArray) -> PixelArray:
    """Return plain numbers as integers: floats with 16 bits."""
    if pixels.dtype.kind != "f":
        return pixels
    data: PixelArray = np.rint(65535 * np.clip(pixels.astype(np.float64), 0, 1)).astype(np.uint16)
    return data


def alpha_mode(pages: Sequence[PixelArray]) -> str:
    """Return glTF's alphaMode, the cheapest one that shows the images' alpha, for all pages of an atlas.

    Alpha that is not 1 everywhere is blended, or a mask if nearly all of it is 0 or 1.
    """
    channel = alpha_channel(pages[0].shape[2])
    if channel is None:
        return "OPAQUE"
    alphas = [page[:, :, channel] for page in pages]
    top = 1 if alphas[0].dtype.kind == "f" else np.iinfo(alphas[0].dtype).max
    if all((alpha >= top).all() for alpha in alphas):
        return "OPAQUE"
    # Cut-outs have a few soft texels, where blocks and gutters blend. A mask needs no sorting by depth.
    soft = sum(np.count_nonzero((alpha > 0.1 * top) & (alpha < 0.9 * top)) for alpha in alphas)
    return "MASK" if soft < sum(alpha.size for alpha in alphas) / 20 else "BLEND"
