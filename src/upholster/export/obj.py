"""Wavefront OBJ with its material and texture: what any modelling program reads."""

import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.export.maps import map_companion
from upholster.image import alpha_channel, write_image
from upholster.model import Mesh
from upholster.types import FloatArray, PixelArray

__all__ = ["obj_companions", "write_obj"]

_LINES = {
    "normal": ("norm",),
    "roughness": ("Pr 1", "map_Pr"),
    "metallic": ("Pm 1", "map_Pm"),
    "emission": ("Ke 1 1 1", "map_Ke"),
}
"""How MTL names maps, the last word of each, and the factors that go with them."""

_ROWS = 1 << 15
"""Lines that are formatted at a time."""


def obj_companions(path: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Return where material and texture of ``ring.obj`` lie: ``ring.mtl``, ``ring_texture.png`` beside it.

    ``ring.png`` stays free for a picture of the model.
    """
    target = Path(path)
    return target.with_suffix(".mtl"), target.with_name(f"{target.stem}_texture.png")


def write_obj(
    path: str | os.PathLike[str],
    material: str | os.PathLike[str],
    texture: str | os.PathLike[str],
    mesh: Mesh,
    uv: FloatArray,
    pixels: PixelArray,
    *,
    stem: str,
    maps: Collection[str] = (),
) -> None:
    """Write a textured model as OBJ, MTL and an image.

    The y axis is up, as importers expect: (x, y, z) is written as (x, z, -y). Quadrilaterals stay
    quadrilaterals, but where an edge is a point they become triangles. Vertices at one place are one ``v``,
    so the model is welded, whatever its texture coordinates. v of ``vt`` points up.

    Parameters
    ----------
    path, material, texture
        The three files to write, which may be temporary ones.
    mesh, uv, pixels
        As for `upholster.export.write_glb`.
    stem
        The files refer to each other as ``stem.mtl`` and ``stem_texture`` with the suffix of `texture`.
    maps
        Roles of a material's other maps. The caller writes them, as `map_companion` of the texture names
        them; here MTL refers to them, in the common extension for physically based rendering. Height and
        occlusion, for which it has no word that programs agree on, are named in comments.

    Raises
    ------
    InputError
        If the texture's format is unknown or cannot hold the image.

    References
    ----------
    Wavefront Technologies: Object Files (.obj), Appendix B1 of the Advanced Visualizer manual.
    Exocortex: Extending the Wavefront MTL format for physically based rendering (Pr, Pm, norm), 2012.
    """
    suffix = Path(texture).suffix
    material_name = "_".join(stem.split()) or "material"  # spaces would end it
    write_image(texture, pixels, bits=16 if pixels.dtype == np.uint16 else 8)
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # applied from the right
    places, place_of = np.unique(mesh.positions @ turned + 0.0, axis=0, return_inverse=True)
    place_of = place_of.reshape(-1)  # + 0.0 made -0.0 equal to 0.0
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# upholster {__version__}\nmtllib {stem}.mtl\no {stem}\n")
        _rows(file, "v %.9g %.9g %.9g\n", places)
        _rows(file, "vt %.7f %.7f\n", np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]))
        _rows(file, "vn %.6f %.6f %.6f\n", mesh.normals @ turned + 0.0)
        file.write(f"usemtl {material_name}\n")
        for corners in _faces(mesh, place_of):
            numbers = np.stack([place_of[corners], corners, corners], axis=2) + 1
            _rows(file, "f" + " %d/%d/%d" * corners.shape[1] + "\n", numbers)
    looks = ["Kd 1 1 1", "Ks 0 0 0", "illum 1"]
    looks += [
        default for role, default in (("roughness", "Pr 0.8"), ("metallic", "Pm 0")) if role not in maps
    ]
    lines = [f"newmtl {material_name}", *looks, f"map_Kd {stem}_texture{suffix}"]
    if alpha_channel(pixels.shape[2]) is not None:
        lines.append(f"map_d {stem}_texture{suffix}")
    for role in maps:
        *factors, word = _LINES.get(role, (f"# {role}:",))
        lines += [*factors, f"{word} {map_companion(f'{stem}_texture{suffix}', role).name}"]
    Path(material).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _faces(mesh: Mesh, place_of: NDArray[np.integer]) -> Iterator[NDArray[np.integer]]:
    """Yield arrays of faces, (N, 4) and (N, 3): no face has two corners at one place."""
    corners = place_of[mesh.quads]
    doubled = corners == np.roll(corners, -1, axis=1)  # corner k lies where k + 1 does
    whole = ~doubled.any(axis=1)
    yield mesh.quads[whole]
    for corner in range(4):
        collapsed = doubled[:, corner] & (doubled.sum(axis=1) == 1)
        yield np.delete(mesh.quads[collapsed], corner, axis=1)
    yield mesh.triangles


def _rows(file: TextIO, form: str, values: NDArray[np.generic]) -> None:
    """Write one line per row: many rows in one formatting are ten times as fast as one by one."""
    for start in range(0, len(values), _ROWS):
        part = values[start : start + _ROWS]
        file.write(form * len(part) % tuple(part.ravel().tolist()))
