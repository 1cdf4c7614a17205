"""PLY with texture coordinates, which MeshLab, Blender and programs for scans read."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.base.files import writing
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.meshes.triangle_mesh import welded
from upholster.image.files.write import write_image
from upholster.output.export.obj import whole_polygons
from upholster.output.export.pages import PagedMesh, check_pages, page_files

__all__ = ["write_ply"]


def write_ply(
    path: str | os.PathLike[str],
    texture: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    model: PagedMesh,
    *,
    stem: str,
) -> None:
    """Write a textured model as binary PLY and an image, or an image for each page of its atlas.

    z is up, as in the model. Texture coordinates, v upward, are stored at the vertices (``s``, ``t``:
    Blender) and at the corners of faces (``texcoord``: MeshLab); with several pages, each face stores its
    page (``texnumber``). Charts that meet do not share vertices, even at the same place. Quadrilaterals stay
    quadrilaterals, but become triangles if one of their edges is a point.

    Parameters
    ----------
    path, texture
        The files to write, which may be temporary ones; a texture for each page.
    model
        The mesh and its atlas.
    stem
        The file refers to ``stem_texture`` with the suffix of `texture`; with several pages to
        ``stem_texture_1`` …

    Raises
    ------
    InputError
        If the texture's format is unknown or cannot hold the image, or the numbers of textures and pages
        differ.

    References
    ----------
    G. Turk: The PLY polygon file format, 1994.
    """
    textures = [texture] if isinstance(texture, (str, os.PathLike)) else texture
    images, mesh, uv, page = model.images, model.mesh, model.uv, model.page
    check_pages(len(textures), page, {"base colour": images})
    for file_name, image in zip(textures, images, strict=True):
        write_image(file_name, image, bits=16 if image.dtype == np.uint16 else 8)
    upward = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
    vertices = np.concatenate([mesh.positions, mesh.normals, upward], axis=1).astype("<f4")
    own_page = np.zeros(len(vertices), np.int32) if page is None else page
    _, place_of = welded(mesh.positions)
    faces = [
        _rows(polygons, upward, own_page if len(images) > 1 else None)
        for polygons in whole_polygons(mesh, place_of)
        if len(polygons)
    ]
    names = page_files(f"{stem}_texture{Path(textures[0]).suffix}", len(images))
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment upholster {__version__}",
        *(f"comment TextureFile {name.name}" for name in names),
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t")),
        f"element face {sum(map(len, faces))}",
        "property list uchar int vertex_indices",
        "property list uchar float texcoord",
        *(["property int texnumber"] if len(images) > 1 else []),
        "end_header",
    ]
    with writing(path) as file:
        file.write(("\n".join(lines) + "\n").encode())
        file.write(vertices.tobytes())
        for rows in faces:
            file.write(rows.tobytes())


def _rows(polygons: IntArray, uv: FloatArray, page: IntArray | None) -> NDArray[np.void]:
    """Return the rows of polygons (N, n)."""
    sides = polygons.shape[1]
    kinds = [("count", "u1"), ("corners", "<i4", sides), ("numbers", "u1"), ("uv", "<f4", 2 * sides)]
    rows = np.empty(len(polygons), [*kinds, ("page", "<i4")] if page is not None else kinds)
    rows["count"], rows["numbers"] = sides, 2 * sides
    rows["corners"] = polygons
    rows["uv"] = uv[polygons].reshape(len(polygons), -1)
    if page is not None:
        rows["page"] = page[polygons[:, 0]]
    return rows
