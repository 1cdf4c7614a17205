"""glTF 2.0 in one binary file (GLB): mesh, textures and material; opens in browsers, Blender and engines."""

import json
import os
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.base.errors import InputError
from upholster.base.files import writing
from upholster.base.types import FloatArray
from upholster.output.export.gltf_edit import mime_type
from upholster.output.export.pages import PagedMesh, PageImages, check_pages, images_of, polygons_by_page
from upholster.output.export.pbr import PbrMaterial, TextureFormat, alpha_mode, build_material

__all__ = ["TextureFormat", "write_glb"]

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP_TO_EDGE = 9729, 9987, 33071
_HALF = 0.5**0.5


def write_glb(
    path: str | os.PathLike[str],
    model: PagedMesh,
    *,
    texture: TextureFormat = "png",
    quality: int = 90,
    maps: Mapping[str, PageImages] | None = None,
    tangents: FloatArray | None = None,
    normal_scale: float = 1.0,
    name: str = "upholster",
) -> None:
    """Write a textured model as GLB.

    glTF's y axis is up, and its unit is a metre: a root node turns our z axis there and scales. Colours are
    the material's base colour, sRGB-coded. A 16-bit atlas becomes a 16-bit PNG, or 8-bit JPEG or WebP; a
    float atlas 8-bit, clipped to 0…1. If alpha is not 1 everywhere, the material is blended, or a mask if
    nearly all of it is 0 or 1. An atlas of several pages becomes one material per page, and one mesh with one
    primitive per page; these share their vertices.

    Parameters
    ----------
    path
        The file to write.
    model
        The mesh and its atlas; its unit is taken as a metre if it is not known.
    texture
        Image format: "auto" (colours without alpha "jpeg", others "png"), "png" (lossless), "jpeg" (no alpha)
        or "webp" (small; extension EXT_texture_webp).
    quality
        1 to 100, for jpeg and webp; maps other than colours get at least 90.
    maps
        Atlases of a material's other maps by role: normal (H, W, 3), in the frame that
        `upholster.quilt.normal_painting.paint_normals` defines; roughness, metallic, ao (H, W, 1), packed in
        one image; emission. Floats become 16-bit. Each is a list if the model's `pixels` is one.
    tangents
        (V, 3), as `upholster.model.tangents.vertex_tangents` gives: needed with a normal map.
    normal_scale
        Strength of the normal map, 0 to 100: glTF's ``normalTexture.scale``.
    name
        Name of mesh, material and image.

    Raises
    ------
    InputError
        If `texture` is unknown, cannot hold the alpha, or is too large; if a role is unknown, a map's shape
        does not fit, or a normal map has no tangents; if the numbers of images and pages differ; if the
        file would exceed 4 GiB.

    References
    ----------
    Khronos: glTF 2.0 specification, chapters 3 and 4 (3.7.2.1: tangents; 3.9: materials).
    """
    maps, mesh, page = maps or {}, model.mesh, model.page
    if "normal" in maps and (tangents is None or tangents.shape != mesh.positions.shape):
        raise InputError("a normal map needs tangents, one for each vertex of the mesh")
    if not 0 <= normal_scale <= 100:
        raise InputError(f"normal_scale is {normal_scale}; allowed: 0 to 100")
    pages = model.images
    check_pages(len(pages), page, maps)
    mode = alpha_mode(pages)
    materials: list[PbrMaterial] = []
    for number, image in enumerate(pages):
        materials.append(
            build_material(
                image,
                {role: images_of(part)[number] for role, part in maps.items()},
                texture=texture,
                quality=quality,
                normal_scale=normal_scale,
                name=name if len(pages) == 1 else f"{name} {number + 1}",
                mode=mode,
                first=sum(len(material.images) for material in materials),
            )
        )
    positions = mesh.positions.astype("<f4")
    vertices = {
        "POSITION": positions,
        "NORMAL": mesh.normals.astype("<f4"),
        "TEXCOORD_0": model.uv.astype("<f4"),
    }
    if "normal" in maps and tangents is not None:
        # The bitangent is (N × T)·w: up in the texture.
        vertices["TANGENT"] = np.concatenate([tangents, np.ones((len(tangents), 1))], axis=1).astype("<f4")
    integer = "<u2" if len(positions) < 65536 else "<u4"
    indices = [part.astype(integer) for part in polygons_by_page(mesh.all_triangles(), page, len(pages))]
    images = [image for material in materials for _, image in material.images]
    parts = [*(part.tobytes() for part in (*vertices.values(), *indices)), *images]
    head = _document(parts, vertices, indices, materials, texture, name)
    if model.metres not in (None, 1.0):
        head["nodes"][0]["scale"] = [model.metres] * 3
    text = json.dumps(head, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    size = sum(len(part) + -len(part) % 4 for part in parts)
    total = 12 + 8 + len(text) + 8 + size
    if total >= 1 << 32:
        raise InputError(f"GLB file would take {total} bytes; allowed: less than 4 GiB")
    with writing(path) as file:
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", size, b"BIN\0"))
        for part in parts:
            file.write(part)
            file.write(b"\0" * (-len(part) % 4))


def _document(
    parts: list[bytes],
    vertices: dict[str, NDArray[Any]],
    indices: Sequence[NDArray[Any]],
    materials: Sequence[PbrMaterial],
    texture: TextureFormat,
    name: str,
) -> dict[str, Any]:
    """Return the JSON chunk. Buffer views: the vertices' attributes, indices of each page, images."""
    geometry = len(vertices) + len(indices)
    coded = [image for material in materials for image in material.images]
    views: list[dict[str, Any]] = []
    offset = 0
    for number, part in enumerate(parts):
        view: dict[str, Any] = {"buffer": 0, "byteOffset": offset, "byteLength": len(part)}
        if number < geometry:
            view["target"] = _VERTICES if number < len(vertices) else _INDICES
        views.append(view)
        offset += len(part) + -len(part) % 4
    accessors: list[dict[str, Any]] = [
        {"bufferView": n, "componentType": _FLOAT, "count": len(part), "type": f"VEC{part.shape[1]}"}
        for n, part in enumerate(vertices.values())
    ]
    positions = vertices["POSITION"]
    accessors[0] |= {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    accessors += [
        {
            "bufferView": len(vertices) + n,
            "componentType": _USHORT if part.itemsize == 2 else _UINT,
            "count": part.size,
            "type": "SCALAR",
        }
        for n, part in enumerate(indices)
    ]
    webp = texture == "webp"
    sampler = {
        "magFilter": _LINEAR,
        "minFilter": _LINEAR_MIPMAP_LINEAR,
        "wrapS": _CLAMP_TO_EDGE,
        "wrapT": _CLAMP_TO_EDGE,
    }
    textures: list[dict[str, Any]] = [
        {"sampler": 0, **({"extensions": {"EXT_texture_webp": {"source": n}}} if webp else {"source": n})}
        for n in range(len(coded))
    ]
    primitives = [
        {
            "attributes": {attribute: n for n, attribute in enumerate(vertices)},
            "indices": len(vertices) + number,
            "material": number,
        }
        for number in range(len(materials))
    ]
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"upholster {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0, "rotation": [-_HALF, 0, 0, _HALF]}],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": [material.document for material in materials],
        "textures": textures,
        "samplers": [sampler],
        "images": [
            {"name": title, "bufferView": geometry + n, "mimeType": mime_type(data)}
            for n, (title, data) in enumerate(coded)
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": offset}],
    }
    if webp:
        document |= {"extensionsUsed": ["EXT_texture_webp"], "extensionsRequired": ["EXT_texture_webp"]}
    return document
