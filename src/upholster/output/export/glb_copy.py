"""A copy of a glTF file with other textures: only materials of covered parts change."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.gltf.accessors import COMPONENTS, Accessor, Accessors, as_floats
from upholster.geometry.gltf.gltf import Json
from upholster.geometry.model_files.gltf_scene import DRACO, primitive_arrays
from upholster.geometry.model_files.model_file import GltfPart, ModelFile
from upholster.model.tangents import mesh_tangents
from upholster.output.export.gltf_edit import GltfEdit, write_parts
from upholster.output.export.pages import PageImages, check_pages, images_of
from upholster.output.export.pbr import TextureFormat, alpha_mode, build_material
from upholster.output.export.vertex_splits import SplitVertices, split_vertices

__all__ = ["Cover", "write_retextured_glb"]

_SAMPLER = {"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}
"""Linear, mipmapped; clamped to the edge."""

_OLD_COORDINATES = "TEXCOORD_0"
_VARIANTS = "KHR_materials_variants"
_PLAIN = -1


@dataclass(frozen=True, eq=False)
class Cover:
    """A texture on some triangles of a model.

    Attributes
    ----------
    uv
        (n, 3, 2) texture coordinates of the triangles' corners, each on its page: 0 to 1, v downward.
    images
        The base colour (H, W, C) as for `write_glb`; or a list, with the image of each page.
    triangles
        (n,) indices of triangles of `ModelFile.mesh`; by default all.
    page
        (n,) the page of each; by default the first.
    maps
        Other maps by role, as for `write_glb`.
    name
        The material's name; by default the model's.
    """

    uv: FloatArray
    images: PageImages
    triangles: NDArray[np.integer] | None = None
    page: NDArray[np.integer] | None = None
    maps: Mapping[str, PageImages] = field(default_factory=dict)
    name: str = ""


def write_retextured_glb(
    path: str | os.PathLike[str],
    model: ModelFile,
    covers: Sequence[Cover],
    *,
    texture: TextureFormat = "png",
    quality: int = 90,
    normal_scale: float = 1.0,
) -> tuple[str, ...]:
    """Write a glTF model as GLB with new textures.

    Everything else stays as it is, in its own type and to the bit: nodes, names, animations, skins, morph
    targets, cameras, lights, other materials, extensions. Vertices are split only where texture coordinates
    need it; the new ones follow the old. Triangles without a cover keep their material and texture
    coordinates. Data compressed with Draco is written uncompressed if it is covered; quantised numbers stay
    quantised. Vertex colours, which would tint the texture, become the attribute ``_COLOR_0``.

    Parameters
    ----------
    path
        The file to write.
    model
        The result of `read_model`.
    covers
        The textures; no triangle has more than one.
    texture, quality, normal_scale
        As for `write_glb`.

    Returns
    -------
    tuple
        Parts that could not be kept, one line each.

    Raises
    ------
    InputError
        If the model is no glTF file, shapes do not fit, or a triangle is covered twice; as for `write_glb`.
    FormatError
        If a part of the document that was not read before breaks the format.
    """
    if model.gltf is None:
        raise InputError(f"{model.path} is not a glTF file; allowed: .glb or .gltf")
    uv, group = _groups(model, covers)
    edit = GltfEdit(model.gltf)
    try:
        materials = _add_materials(edit, model, covers, group, texture, quality, normal_scale)
        notes = _rewrite(edit, model, uv, group, materials)
        parts = edit.glb()
    except (AttributeError, IndexError, KeyError, StopIteration, TypeError, ValueError) as error:
        # The reader checked the parts that it read; the rest of the file may hold anything.
        raise FormatError(f"{model.path}: its JSON is not valid glTF: {error!r}") from None
    write_parts(Path(path), parts)
    return (*notes, *edit.notes)


def _groups(model: ModelFile, covers: Sequence[Cover]) -> tuple[FloatArray, IntArray]:
    """Return texture coordinates of all triangles, and the page of each among all covers' pages, -1: none."""
    count = len(model.mesh.triangles)
    uv = np.zeros((count, 3, 2))
    group = np.full(count, _PLAIN, np.int32)
    first = 0
    for cover in covers:
        mine = np.arange(count) if cover.triangles is None else np.asarray(cover.triangles)
        page = np.zeros(len(mine), np.int32) if cover.page is None else np.asarray(cover.page, np.int32)
        if cover.uv.shape != (len(mine), 3, 2) or page.shape != (len(mine),):
            raise InputError(
                f"a cover has {len(mine)} triangles, texture coordinates of shape {cover.uv.shape} and pages "
                f"of {page.shape}; allowed: (n,), (n, 3, 2) and (n,)"
            )
        pages = len(images_of(cover.images))
        check_pages(pages, page, cover.maps)
        if len(mine) and (mine.min() < 0 or mine.max() >= count or page.min() < 0):
            raise InputError(
                f"a cover has triangle {mine.max()} or page {page.min()}; there are {count} triangles"
            )
        if (group[mine] != _PLAIN).any() or len(np.unique(mine)) < len(mine):
            raise InputError("a triangle is covered twice; allowed: once")
        if not np.isfinite(cover.uv).all():
            raise InputError("a texture coordinate is not finite; allowed: finite numbers")
        uv[mine], group[mine] = cover.uv, first + page
        first += pages
    return uv, group


def _add_materials(
    edit: GltfEdit,
    model: ModelFile,
    covers: Sequence[Cover],
    group: IntArray,
    texture: TextureFormat,
    quality: int,
    normal_scale: float,
) -> list[tuple[int, bool]]:
    """Add a material for each page of each cover; return their numbers, and whether they have normal maps."""
    if not 0 <= normal_scale <= 100:
        raise InputError(f"normal_scale is {normal_scale}; allowed: 0 to 100")
    sampler = edit.append("samplers", dict(_SAMPLER))
    sides = _two_sided(model, group)
    out: list[tuple[int, bool]] = []
    for cover in covers:
        images = images_of(cover.images)
        mode = alpha_mode(images)
        title = cover.name or model.mesh.name or "texture"
        for number, image in enumerate(images):
            made = build_material(
                image,
                {role: images_of(part)[number] for role, part in cover.maps.items()},
                texture=texture,
                quality=quality,
                normal_scale=normal_scale,
                name=title if len(images) == 1 else f"{title} {number + 1}",
                mode=mode,
                first=len(edit.json.get("textures", [])),
            )
            for name, data in made.images:
                source = edit.add_image(data, name)
                entry: Json = {"sampler": sampler, "source": source}
                if texture == "webp":
                    entry = {"sampler": sampler, "extensions": {"EXT_texture_webp": {"source": source}}}
                edit.append("textures", entry)
            # A deep copy, in which no object occurs twice, because its numbers may be changed.
            document = json.loads(json.dumps(made.document))
            if len(out) not in sides:
                document.pop("doubleSided", None)
            out.append((edit.append("materials", document), "normal" in cover.maps))
    if texture == "webp":
        edit.use_extension("EXT_texture_webp")
    return out


def _two_sided(model: ModelFile, group: IntArray) -> set[int]:
    """Return the pages with any triangle whose old material shows both sides, or that had none."""
    assert model.gltf is not None
    out: set[int] = set()
    for number, part in enumerate(model.gltf_parts):
        primitive = model.gltf.items("meshes")[part.mesh]["primitives"][part.primitive]
        material = model.gltf.item("materials", primitive["material"]) if "material" in primitive else None
        if material is None or material.get("doubleSided") is True:
            out.update(np.unique(group[model.mesh.part == number]).tolist())
    return out


def _rewrite(
    edit: GltfEdit, model: ModelFile, uv: FloatArray, group: IntArray, materials: list[tuple[int, bool]]
) -> list[str]:
    """Replace covered primitives with ones that have the new coordinates and materials."""
    assert model.gltf is not None
    accessors = Accessors(model.gltf)
    starts = np.searchsorted(model.mesh.part, np.arange(len(model.parts) + 1))
    new: dict[int, dict[int, list[Json]]] = {}
    colours = variants = tangents = lost = 0
    for number, part in enumerate(model.gltf_parts):
        mine = slice(starts[number], starts[number + 1])
        if (group[mine] == _PLAIN).all():
            continue
        primitive = edit.json["meshes"][part.mesh]["primitives"][part.primitive]
        arrays, indices = primitive_arrays(model.gltf, accessors, primitive)
        work = _Primitive(edit, accessors, primitive, arrays, indices is not None, part)
        new.setdefault(part.mesh, {})[part.primitive] = work.replaced(uv[mine], group[mine], materials)
        colours += "COLOR_0" in arrays
        tangents += work.renews_tangents
        lost += work.loses_tangents
        variants += _VARIANTS in primitive.get("extensions", {})
    for mesh, primitives in new.items():
        entry = edit.json["meshes"][mesh]
        entry["primitives"] = [
            each for n, old in enumerate(entry["primitives"]) for each in primitives.get(n, [old])
        ]
    notes = []
    if colours:
        shown = number_of(colours, "part")
        notes.append(f"vertex colours of {shown}, which would tint the texture, are kept as _COLOR_0")
    if variants:
        shown = number_of(variants, "part has lost its", "parts have lost their")
        notes.append(f"{shown} variants, which would bring the old materials back")
    if tangents:
        notes.append(
            f"tangents of {number_of(tangents, 'part')} are recomputed for the new texture coordinates"
        )
    if lost:
        notes.append(
            f"tangents of {number_of(lost, 'part')} are left out: of morph targets, or without normals"
        )
    return notes


@dataclass(eq=False)
class _Primitive:
    """A primitive that is covered entirely or partly."""

    edit: GltfEdit
    accessors: Accessors
    primitive: Json
    arrays: dict[str, Accessor]
    indexed: bool
    part: GltfPart

    @property
    def renews_tangents(self) -> bool:
        """Whether it has tangents, and gets new ones along the new texture coordinates."""
        return "TANGENT" in self.arrays and "NORMAL" in self.arrays

    @property
    def loses_tangents(self) -> bool:
        """Whether it has tangents that cannot be recomputed: without normals, or of morph targets."""
        alone = "TANGENT" in self.arrays and "NORMAL" not in self.arrays
        return alone or any("TANGENT" in target for target in self.primitive.get("targets", []))

    def replaced(self, uv: FloatArray, group: IntArray, materials: list[tuple[int, bool]]) -> list[Json]:
        """Return the primitives that replace it: one for each page, and one for triangles without a cover."""
        present = np.unique(group)
        out = []
        for each in present:
            mine = group == each
            material, bumpy = (None, False) if each == _PLAIN else materials[each]
            out.append(self._one(uv[mine], mine, material, bumpy, whole=len(present) == 1))
        return out

    def _one(
        self,
        uv: FloatArray,
        mine: NDArray[np.bool_],
        material: int | None,
        bumpy: bool,
        *,
        whole: bool,
    ) -> Json:
        vertices = self.part.vertices[mine]
        if material is None:
            uv = np.zeros_like(uv)  # so that nothing is split
        split = split_vertices(vertices, uv, len(self.arrays["POSITION"].values), all_vertices=whole)
        made: Json = json.loads(json.dumps(self.primitive))
        made["mode"] = 4
        extensions = made.get("extensions", {})
        for name in (DRACO,) if material is None else (DRACO, _VARIANTS):
            extensions.pop(name, None)
        if not extensions:
            made.pop("extensions", None)
        if material is not None:
            made["material"] = material
        self._attributes(made, split, covered=material is not None)
        if material is not None:
            single = self.edit.add_attribute(split.uv)
            made["attributes"][_OLD_COORDINATES] = single
            if self.renews_tangents or (bumpy and "NORMAL" in self.arrays):
                made["attributes"]["TANGENT"] = self._tangents(uv, split)
        self._indices(made, split)
        return made

    def _attributes(self, made: Json, split: SplitVertices, *, covered: bool) -> None:
        """Move all attributes and morph targets to the new vertices."""
        attributes: Json = made["attributes"]
        targets: list[Json] = made.get("targets", [])
        old_names: dict[str, str] = {}
        if covered:
            for holder in (attributes, *targets):
                for name in [name for name in holder if name.startswith("COLOR_")]:
                    holder[f"_{name}"] = holder.pop(name)
                    old_names[f"_{name}"] = name
                holder.pop(_OLD_COORDINATES, None)
                holder.pop("TANGENT", None)
        same = np.array_equal(split.source, np.arange(len(self.arrays["POSITION"].values)))
        for name, number in attributes.items():
            old = old_names.get(name, name)
            if not same or self._is_draco(old):
                attributes[name] = self._followed(number, self.arrays[old], split, bounds=name == "POSITION")
        for target in targets:
            for name, number in target.items():
                if not same:
                    values = self.accessors.read(number, 1, 2, 3, 4)
                    target[name] = self._followed(number, values, split, bounds=name == "POSITION")

    def _is_draco(self, name: str) -> bool:
        compressed = self.primitive.get("extensions", {}).get(DRACO)
        return compressed is not None and name in compressed["attributes"]

    def _followed(self, number: Any, values: Accessor, split: SplitVertices, *, bounds: bool) -> int:
        """Add an accessor with the values of an attribute at the new vertices."""
        entry = self.edit.json["accessors"][number]
        kind = COMPONENTS[entry["componentType"]]
        chosen = values.values.astype(kind)[split.source]
        made = self.edit.add_attribute(
            chosen, normalized=entry.get("normalized") is True, bounds=bounds or "min" in entry
        )
        kept = {key: entry[key] for key in ("name", "extras") if key in entry}
        self.edit.json["accessors"][made] |= kept
        return made

    def _tangents(self, uv: FloatArray, split: SplitVertices) -> int:
        """Add tangents along u."""
        normals = as_floats(self.arrays["NORMAL"])[split.source]
        positions = as_floats(self.arrays["POSITION"])[split.source]
        tangents = mesh_tangents(positions, normals, split.triangles, uv)
        if self.part.mirrored:
            tangents[:, 3] *= -1  # the node mirrors the model, so the other side of the texture is seen
        return self.edit.add_attribute(tangents.astype("<f4"))

    def _indices(self, made: Json, split: SplitVertices) -> None:
        """Store the vertices of the triangles: the old accessor if nothing has changed."""
        triangles = split.triangles[:, [0, 2, 1]] if self.part.mirrored else split.triangles
        count = len(split.source)
        if not self.indexed and np.array_equal(triangles.reshape(-1), np.arange(count)):
            made.pop("indices", None)
            return
        unchanged = (
            self.indexed
            and self.primitive.get("mode", 4) == 4
            and DRACO not in self.primitive.get("extensions", {})
            and np.array_equal(split.triangles, self.part.vertices)
        )
        if not unchanged:
            made["indices"] = self.edit.add_indices(triangles, count)
