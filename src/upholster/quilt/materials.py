"""Painting whole materials: every map by the same quilt."""

from upholster.image.material import Material
from upholster.image.source import Source, as_exemplar
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.normals import paint_normals, unit_normals
from upholster.quilt.painting import paint
from upholster.types import PixelArray, Progress

__all__ = ["paint_map", "paint_material"]


def paint_material(
    quilt: Quilt, material: Material | Source, *, threads: int | None = None, progress: Progress | None = None
) -> dict[str, Texels]:
    """Paint a quilt with all maps of a material.

    Parameters
    ----------
    quilt
        Where each block comes from.
    material
        Its maps have the exemplar's height and width. Or its folder, or its files by role.
    threads, progress
        As in `upholster.quilt.paint`.

    Returns
    -------
    dict
        Texels by role, each at its map's depth: "albedo", with the opacity as its alpha, then the other maps
        but opacity. Normals are in the tangent frame of `upholster.quilt.normals.paint_normals`, and of
        length 1 where blocks are blended, too.

    Raises
    ------
    InputError
        If it is no material, or has another height or width than the quilt's exemplar.
    """
    if not isinstance(material, Material):
        found = as_exemplar(material)
        material = found if isinstance(found, Material) else Material({"albedo": found})
    painted = {"albedo": paint(quilt, material.color(), threads=threads, progress=progress)}
    for role, pixels in material.maps.items():
        if role not in ("albedo", "opacity"):
            painted[role] = paint_map(quilt, role, pixels, threads=threads, progress=progress)
    if "normal" in painted:
        painted["normal"] = unit_normals(painted["normal"], threads=threads)
    return painted


def paint_map(
    quilt: Quilt,
    role: str,
    pixels: PixelArray,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Texels:
    """Paint a quilt with one map, as decoders do: normals turn with the texture, all others are as they are.

    Raises
    ------
    InputError
        As `paint` and `paint_normals` do.
    """
    work = paint_normals if role == "normal" else paint
    return work(quilt, pixels, threads=threads, progress=progress)
