"""References within a glTF document, so that unused objects can be left out."""

from collections.abc import Callable, Iterator
from typing import Any

from upholster.geometry.gltf.gltf import Json

__all__ = ["prune"]

_KNOWN = (
    "KHR_materials_",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_xmp",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "EXT_texture_avif",
)
"""Extensions whose numbers of buffer views, accessors, images and textures are found below."""

_Reference = tuple[dict[str, Any], str]
"""An object, and the key of a number in it."""


def prune(document: Json, before: Json) -> None:
    """Remove materials, textures, images, accessors and views that nothing in a document uses any more.

    Objects that were unused before stay. Numbers of the remaining ones are updated wherever they are used. If
    the document uses an unknown extension, nothing is removed.

    Parameters
    ----------
    document
        The document; it is changed.
    before
        The document before the changes, which only appended to these lists.
    """
    if any(not str(name).startswith(_KNOWN) for name in document.get("extensionsUsed", [])):
        return
    for kind, references in _REFERENCES:
        items = document.get(kind, [])
        was_used = {holder[key] for holder, key in references(before)}
        found = list(references(document))
        used = {holder[key] for holder, key in found}
        kept = [n for n in range(len(items)) if n in used or n not in was_used]
        number = {old: new for new, old in enumerate(kept)}
        for holder, key in found:
            holder[key] = number[holder[key]]
        document.pop(kind, None)
        if kept:
            document[kind] = [items[n] for n in kept]


def _materials(document: Json) -> Iterator[_Reference]:
    for mesh in document.get("meshes", []):
        for primitive in mesh.get("primitives", []):
            mappings = _extension(primitive, "KHR_materials_variants").get("mappings", [])
            yield from ((each, "material") for each in (primitive, *mappings) if "material" in each)


def _textures(document: Json) -> Iterator[_Reference]:
    waiting: list[Any] = list(document.get("materials", []))
    while waiting:
        item = waiting.pop()
        if isinstance(item, list):
            waiting += item
        elif isinstance(item, dict):
            for key, value in item.items():
                if key.endswith("Texture") and isinstance(value, dict) and _is_number(value.get("index")):
                    yield value, "index"
                if key != "extras":
                    waiting.append(value)


def _samplers(document: Json) -> Iterator[_Reference]:
    yield from ((texture, "sampler") for texture in document.get("textures", []) if "sampler" in texture)


def _images(document: Json) -> Iterator[_Reference]:
    for texture in document.get("textures", []):
        for holder in (texture, *_objects(texture.get("extensions"))):
            if _is_number(holder.get("source")):
                yield holder, "source"


def _accessors(document: Json) -> Iterator[_Reference]:
    for mesh in document.get("meshes", []):
        for primitive in mesh.get("primitives", []):
            for attributes in (primitive.get("attributes", {}), *primitive.get("targets", [])):
                yield from ((attributes, name) for name in attributes)
            if "indices" in primitive:
                yield primitive, "indices"
    for skin in document.get("skins", []):
        if "inverseBindMatrices" in skin:
            yield skin, "inverseBindMatrices"
    for animation in document.get("animations", []):
        for sampler in animation.get("samplers", []):
            yield from ((sampler, key) for key in ("input", "output") if key in sampler)
    for node in document.get("nodes", []):
        attributes = _extension(node, "EXT_mesh_gpu_instancing").get("attributes", {})
        yield from ((attributes, name) for name in attributes)


def _views(document: Json) -> Iterator[_Reference]:
    for accessor in document.get("accessors", []):
        sparse = accessor.get("sparse", {})
        for holder in (accessor, sparse.get("indices", {}), sparse.get("values", {})):
            if "bufferView" in holder:
                yield holder, "bufferView"
    for image in document.get("images", []):
        if "bufferView" in image:
            yield image, "bufferView"
    for mesh in document.get("meshes", []):
        for primitive in mesh.get("primitives", []):
            draco = _extension(primitive, "KHR_draco_mesh_compression")
            if "bufferView" in draco:
                yield draco, "bufferView"


_REFERENCES: tuple[tuple[str, Callable[[Json], Iterator[_Reference]]], ...] = (
    ("materials", _materials),
    ("textures", _textures),
    ("samplers", _samplers),
    ("images", _images),
    ("accessors", _accessors),
    ("bufferViews", _views),
)
"""Each kind after the kinds that refer to it."""


def _extension(item: Json, name: str) -> Json:
    found = item.get("extensions", {}).get(name, {})
    return found if isinstance(found, dict) else {}


def _objects(item: Any) -> list[Json]:
    return [value for value in item.values() if isinstance(value, dict)] if isinstance(item, dict) else []


def _is_number(value: object) -> bool:
    return type(value) is int
