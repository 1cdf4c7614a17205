"""Wavefront OBJ with its material and texture, which any modelling program reads."""

import io
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.base.files import write_bytes, writing
from upholster.base.types import IntArray
from upholster.charts.tessellation.mesh import Mesh
from upholster.image.color import alpha_channel
from upholster.image.files.write import write_image
from upholster.image.roles import DEFAULT_ROUGHNESS, MAP_ROLES
from upholster.output.export.map_files import map_companion
from upholster.output.export.pages import PagedMesh, check_pages, page_files, polygons_by_page, udim_tile

__all__ = ["ObjPart", "whole_polygons", "write_obj", "write_tiled_obj"]

_ROWS = 1 << 15
"""Lines formatted at a time."""


class ObjPart(NamedTuple):
    """The names of a part of a model and of its material; '' if it has none."""

    name: str
    material: str = ""


_WHOLE = ObjPart("")


def write_obj(
    path: str | os.PathLike[str],
    material: str | os.PathLike[str],
    texture: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    model: PagedMesh,
    *,
    stem: str,
    maps: Collection[str] = (),
    parts: Sequence[ObjPart] = (),
    part: IntArray | None = None,
) -> None:
    """Write a textured model as OBJ, MTL and an image, or an image and a material for each page of its atlas.

    The y axis is up, as importers expect: (x, y, z) is written as (x, z, -y). Quadrilaterals stay
    quadrilaterals, but become triangles if one of their edges is a point. Vertices at one place are one
    ``v``, so the model is welded, whatever its texture coordinates. v of ``vt`` points up.

    Parameters
    ----------
    path, material, texture
        The three files to write, which may be temporary ones; a texture for each page.
    model
        The mesh and its atlas.
    stem
        The files refer to each other as ``stem.mtl`` and ``stem_texture`` with the suffix of `texture`; with
        several pages as ``stem_texture_1`` …
    maps
        Roles of a material's other maps. The caller writes them, under the texture's names from
        `map_companion`; here MTL refers to them, in the common extension for physically based rendering.
        Height and occlusion, for which programs agree on no keyword, are named in comments.
    parts, part
        For a mesh of triangles alone: the names of its parts, and the part of each triangle, (T,). Each part
        becomes an object; each different material name becomes a material, all with the same texture.

    Raises
    ------
    InputError
        If the texture's format is unknown or cannot hold the image, or the numbers of textures and pages
        differ.

    References
    ----------
    Wavefront Technologies: Object Files (.obj), Appendix B1 of the Advanced Visualizer manual.
    Exocortex: Extending the Wavefront MTL format for physically based rendering (Pr, Pm, norm), 2012.
    """
    textures = [texture] if isinstance(texture, (str, os.PathLike)) else texture
    images = model.images
    check_pages(len(textures), model.page, {"base colour": images})
    for file_name, image in zip(textures, images, strict=True):
        write_image(file_name, image, bits=16 if image.dtype == np.uint16 else 8)
    _write_mesh(Path(path), model, stem=stem, parts=parts, part=part)
    texture_name = f"{stem}_texture{Path(textures[0]).suffix}"
    files = {role: page_files(map_companion(texture_name, role), len(images)) for role in maps}
    files = {"albedo": page_files(texture_name, len(images)), **files}
    on_pages = [{role: own[number].name for role, own in files.items()} for number in range(len(images))]
    alpha = alpha_channel(images[0].shape[2]) is not None
    _write_materials(Path(material), on_pages, stem=stem, parts=parts, alpha=alpha)


def write_tiled_obj(
    path: str | os.PathLike[str],
    material: str | os.PathLike[str],
    model: PagedMesh,
    files: Mapping[str, str],
    *,
    stem: str,
    parts: Sequence[ObjPart] = (),
    part: IntArray | None = None,
    alpha: bool = False,
) -> None:
    """Write a model as OBJ and MTL that refers to UDIM tiles, which the caller writes.

    Parameters
    ----------
    path, material, stem, parts, part
        As for `write_obj`; a material has all tiles.
    model
        The mesh and its pages, of which each is a tile; images are not needed.
    files
        MTL's names for the tiles of each map, with ``<UDIM>`` for their numbers, as Blender, Maya and others
        read it; the base colour's under "albedo".
    alpha
        Whether the base colour has an alpha channel.
    """
    uv = model.uv
    if model.page is not None:
        uv = uv + udim_tile(model.page) * (1, -1)  # v is downward here, and upward in OBJ
    _write_mesh(Path(path), PagedMesh(model.mesh, uv, ()), stem=stem, parts=parts, part=part)
    _write_materials(Path(material), [files], stem=stem, parts=parts, alpha=alpha)


def _write_mesh(
    path: Path,
    model: PagedMesh,
    *,
    stem: str,
    parts: Sequence[ObjPart] = (),
    part: IntArray | None = None,
) -> None:
    """Write the OBJ file: each part has one material per page that it uses."""
    mesh, uv, page, pages = model.mesh, model.uv, model.page, max(1, len(model.images))
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # applied from the right
    places, place_of = np.unique(mesh.positions @ turned + 0.0, axis=0, return_inverse=True)
    place_of = place_of.reshape(-1)  # + 0.0 made -0.0 equal to 0.0
    with writing(path) as opened, io.TextIOWrapper(opened, "utf-8", newline="\n") as file:
        file.write(f"# upholster {__version__}\nmtllib {stem}.mtl\n")
        _rows(file, "v %.9g %.9g %.9g\n", places)
        _rows(file, "vt %.7f %.7f\n", np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]))
        _rows(file, "vn %.6f %.6f %.6f\n", mesh.normals @ turned + 0.0)
        for label, polygons in _by_part(mesh, place_of, parts, part):
            file.write(f"o {' '.join(label.name.split()) or stem}\n")
            kinds = [polygons_by_page(faces, page, pages) for faces in polygons]
            names = _names(label.material or stem, pages)
            for name, on_page in zip(names, zip(*kinds, strict=True), strict=True):
                if not any(map(len, on_page)):
                    continue
                file.write(f"usemtl {name}\n")
                for corners in on_page:
                    numbers = np.stack([place_of[corners], corners, corners], axis=2) + 1
                    _rows(file, "f" + " %d/%d/%d" * corners.shape[1] + "\n", numbers)


def _write_materials(
    path: Path, on_pages: Sequence[Mapping[str, str]], *, stem: str, parts: Sequence[ObjPart], alpha: bool
) -> None:
    """Write the MTL file: every material of the parts on each page, with that page's files by role."""
    called = dict.fromkeys(
        tuple(_names(label.material or stem, len(on_pages))) for label in parts or [_WHOLE]
    )
    lines = [
        line
        for names in called
        for name, files in zip(names, on_pages, strict=True)
        for line in _material(name, files, alpha=alpha)
    ]
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def _names(material: str, pages: int) -> list[str]:
    """Return the names of the materials of an atlas's pages."""
    name = "_".join(material.split()) or "material"  # a space would end the name
    return [name] if pages == 1 else [f"{name}_{number + 1}" for number in range(pages)]


def _by_part(
    mesh: Mesh, place_of: NDArray[np.integer], parts: Sequence[ObjPart], part: IntArray | None
) -> Iterator[tuple[ObjPart, list[IntArray]]]:
    """Yield the polygons of each part; all of them together if no parts are given."""
    if part is None:
        yield _WHOLE, list(whole_polygons(mesh, place_of))
        return
    order = np.argsort(part, kind="stable")
    ends = np.cumsum(np.bincount(part, minlength=len(parts)))
    for label, own in zip(parts, np.split(order, ends[:-1]), strict=True):
        if len(own):
            yield label, [mesh.triangles[own]]


def _material(name: str, files: Mapping[str, str], *, alpha: bool) -> list[str]:
    """Return the MTL lines of a material whose maps are these files, by role."""
    looks = ["Kd 1 1 1", "Ks 0 0 0", "illum 1"]
    defaults = {"roughness": f"Pr {DEFAULT_ROUGHNESS}", "metallic": "Pm 0"}
    looks += [default for role, default in defaults.items() if role not in files]
    lines = [f"newmtl {name}", *looks, f"map_Kd {files['albedo']}"]
    if alpha:
        lines.append(f"map_d {files['albedo']}")
    for role, file in files.items():
        if role != "albedo":
            *factors, word = (role in MAP_ROLES and MAP_ROLES[role].mtl) or (f"# {role}:",)
            lines += [*factors, f"{word} {file}"]
    return lines


def whole_polygons(mesh: Mesh, place_of: NDArray[np.integer]) -> Iterator[IntArray]:
    """Yield a mesh's polygons, (N, 4) and (N, 3), so that no two corners of one are at the same place.

    Parameters
    ----------
    mesh
        The mesh.
    place_of
        (V,) a number for each vertex: equal for vertices at the same place.
    """
    corners = place_of[mesh.quads]
    doubled = corners == np.roll(corners, -1, axis=1)  # corner k is at the place of corner k + 1
    whole = ~doubled.any(axis=1)
    yield mesh.quads[whole]
    for corner in range(4):
        collapsed = doubled[:, corner] & (doubled.sum(axis=1) == 1)
        yield np.delete(mesh.quads[collapsed], corner, axis=1)
    yield mesh.triangles


def _rows(file: TextIO, form: str, values: NDArray[np.generic]) -> None:
    """Write one line per row: formatting many rows at once is ten times as fast as one by one."""
    for start in range(0, len(values), _ROWS):
        part = values[start : start + _ROWS]
        file.write(form * len(part) % tuple(part.ravel().tolist()))
