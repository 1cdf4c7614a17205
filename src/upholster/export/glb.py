"""glTF 2.0 in one binary file (GLB): mesh, texture and material; opens in browsers, Blender and engines."""

import json
import os
import struct
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.errors import InputError, nearest
from upholster.geometry import Mesh
from upholster.image import alpha_channel, encode_image
from upholster.types import FloatArray, PixelArray

__all__ = ["TextureFormat", "write_glb"]

TextureFormat = Literal["png", "jpeg", "webp"]

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP_TO_EDGE = 9729, 9987, 33071
_HALF = 0.5**0.5


def write_glb(
    path: str | os.PathLike[str],
    mesh: Mesh,
    uv: FloatArray,
    pixels: PixelArray,
    *,
    texture: TextureFormat = "png",
    quality: int = 90,
    name: str = "upholster",
) -> None:
    """Write a textured model as GLB.

    glTF's y axis is up: a root node turns our z axis there. Colours lie in the material's base colour,
    sRGB-coded. A 16-bit atlas becomes a 16-bit PNG, or 8-bit JPEG or WebP; a float atlas 8-bit, clipped to
    0…1. Alpha that is not 1 everywhere makes the material blended, or a mask where nearly all is 0 or 1.

    Parameters
    ----------
    path
        The file to write.
    mesh
        Positions in the model's unit, taken as metres; normals of length 1.
    uv
        (V, 2) in 0…1, v downward: `upholster.model.Atlas.texture_coordinates`.
    pixels
        (H, W, C) of the atlas: uint8, uint16 or float32.
    texture
        How the image is coded: "png" (lossless), "jpeg" (no alpha) or "webp" (small; extension
        EXT_texture_webp).
    quality
        1 to 100, for jpeg and webp.
    name
        Of mesh, material and image.

    Raises
    ------
    InputError
        If `texture` is unknown, cannot hold the alpha, or is too large; if the file would pass 4 GiB.

    References
    ----------
    Khronos: glTF 2.0 specification, chapters 3 and 4.
    """
    if texture not in ("png", "jpeg", "webp"):
        raise InputError(f"texture {texture!r} is unknown; {nearest(str(texture), ('png', 'jpeg', 'webp'))}")
    mode = _alpha_mode(pixels)
    if mode == "OPAQUE" and alpha_channel(pixels.shape[2]) is not None:
        pixels = pixels[:, :, :-1]
    elif mode != "OPAQUE" and texture == "jpeg":
        raise InputError("texture 'jpeg' cannot hold the exemplar's alpha; allowed: 'png' or 'webp'")
    positions = mesh.positions.astype("<f4")
    indices = mesh.all_triangles().astype("<u2" if len(positions) < 65536 else "<u4")
    vertices = (positions, mesh.normals.astype("<f4"), uv.astype("<f4"))
    image = encode_image(pixels, texture, quality=quality)
    parts = [*(part.tobytes() for part in (*vertices, indices)), image]
    head = _document(parts, positions, indices, texture, mode, name)
    text = json.dumps(head, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    size = sum(len(part) + -len(part) % 4 for part in parts)
    total = 12 + 8 + len(text) + 8 + size
    if total >= 1 << 32:
        raise InputError(f"GLB file would take {total} bytes; allowed: less than 4 GiB")
    with Path(path).open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", size, b"BIN\0"))
        for part in parts:
            file.write(part)
            file.write(b"\0" * (-len(part) % 4))


def _alpha_mode(pixels: PixelArray) -> str:
    """Return glTF's alphaMode: the cheapest one that shows the image's alpha."""
    channel = alpha_channel(pixels.shape[2])
    if channel is None:
        return "OPAQUE"
    alpha = pixels[:, :, channel]
    top = 1 if alpha.dtype.kind == "f" else np.iinfo(alpha.dtype).max
    if (alpha >= top).all():
        return "OPAQUE"
    # Cut-outs have a few soft texels, where blocks and gutters blend. A mask needs no sorting by depth.
    soft = np.count_nonzero((alpha > 0.1 * top) & (alpha < 0.9 * top))
    return "MASK" if soft < alpha.size / 20 else "BLEND"


def _document(
    parts: list[bytes],
    positions: NDArray[Any],
    indices: NDArray[Any],
    texture: TextureFormat,
    mode: str,
    name: str,
) -> dict[str, Any]:
    """Return the JSON chunk. Buffer views 0…4: positions, normals, coordinates, indices, image."""
    views: list[dict[str, Any]] = []
    offset = 0
    for part, target in zip(parts, (_VERTICES, _VERTICES, _VERTICES, _INDICES, None), strict=True):
        view: dict[str, Any] = {"buffer": 0, "byteOffset": offset, "byteLength": len(part)}
        views.append(view if target is None else view | {"target": target})
        offset += len(part) + -len(part) % 4
    count = len(positions)
    bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    integer = _USHORT if indices.itemsize == 2 else _UINT
    material: dict[str, Any] = {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicFactor": 0,
            "roughnessFactor": 0.8,
        },
        "doubleSided": True,  # open surfaces have a back, too
    }
    if mode != "OPAQUE":
        material["alphaMode"] = mode
    webp = texture == "webp"
    source: dict[str, Any] = {"extensions": {"EXT_texture_webp": {"source": 0}}} if webp else {"source": 0}
    sampler = {
        "magFilter": _LINEAR,
        "minFilter": _LINEAR_MIPMAP_LINEAR,
        "wrapS": _CLAMP_TO_EDGE,
        "wrapT": _CLAMP_TO_EDGE,
    }
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"upholster {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0, "rotation": [-_HALF, 0, 0, _HALF]}],
        "meshes": [{"name": name, "primitives": [primitive]}],
        "materials": [material],
        "textures": [{"sampler": 0, **source}],
        "samplers": [sampler],
        "images": [{"name": name, "bufferView": 4, "mimeType": f"image/{texture}"}],
        "accessors": [
            {"bufferView": 0, "componentType": _FLOAT, "count": count, "type": "VEC3", **bounds},
            {"bufferView": 1, "componentType": _FLOAT, "count": count, "type": "VEC3"},
            {"bufferView": 2, "componentType": _FLOAT, "count": count, "type": "VEC2"},
            {"bufferView": 3, "componentType": integer, "count": indices.size, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": offset}],
    }
    if webp:
        document |= {"extensionsUsed": ["EXT_texture_webp"], "extensionsRequired": ["EXT_texture_webp"]}
    return document
