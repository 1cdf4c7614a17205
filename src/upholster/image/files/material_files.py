"""Reading materials: finding each map's file, and converting sizes, conventions and packed maps."""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from upholster.base.errors import InputError, nearest
from upholster.base.files import path_text
from upholster.base.options.choices import chosen
from upholster.base.options.sample_options import SampleOptions
from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel
from upholster.image.files.material import Material
from upholster.image.files.packages import MapFile, folder_images, is_zip, map_file, zip_images
from upholster.image.files.read import read_used
from upholster.image.masks import as_map, filled, is_white, on_shape
from upholster.image.normal_convention import points_down
from upholster.image.numbers import to_unit, top_of
from upholster.image.photo.preparation import check_crop, check_resize, cut_out, finished, resampled
from upholster.image.profiles import Notes
from upholster.image.roles import COLORS, LEFT_OUT, ROLES, family_of, find_maps, packed_parts, role_of

__all__ = ["FilesByRole", "material_of_files", "read_material"]

FilesByRole = Mapping[str, str | os.PathLike[str]]

_COLORED = 8 / 255
"""A map of single numbers is perhaps packed if its channels differ by more than this on average."""


def read_material(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | FilesByRole,
    *,
    notes: Notes | None = None,
    **choices: Any,
) -> Material:
    """Read a material from its maps' files.

    Parameters
    ----------
    source
        A folder, a zip file as libraries deliver it (never unpacked to disk), or files, whose names say
        which map they hold (``brick_albedo.png``, ``brick_nor_gl_1k.png``, ``T_Brick_ORM.png``; see
        `upholster.image.roles.role_of`); or files by role.
    notes
        As for `upholster.read_exemplar`.
    **choices
        Options of `upholster.SampleOptions`, for all maps alike. Pixels are those of the albedo; even light
        is for the albedo alone. Normals turn and stretch with a rectified map. `maps` are further files by
        role, used whatever their names are, and instead of files found for that role; for a folder or a zip
        file also names of files in it; a role may be a packed order, as ``orm``. Without `normal` its
        direction follows from the file's name, or else from the height map, or else green points upward. A
        mask, `use`, is as large as the albedo.

    Returns
    -------
    Material
        Maps whose sides are a whole multiple or a whole fraction of the albedo's are resampled to it. Normal
        maps in DirectX' convention have their green inverted; gloss becomes roughness; packed images are
        split, and separate maps take precedence over their parts. `Material.notes` lists files left out.

    Raises
    ------
    InputError
        If a file cannot be read, has an unknown role, the role of another one, or a shape that does not fit;
        if there is no albedo; for a crop or a size outside the limits of `read_exemplar`; for a zip file
        outside the limits of `upholster.image.files.packages.zip_images`; for a mask whose size is not the
        albedo's, or that leaves nothing.
    """
    return material_of_files(source, chosen(SampleOptions, **choices), notes)


def material_of_files(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | FilesByRole,
    options: SampleOptions,
    notes: Notes | None,
) -> Material:
    """Read a material with all of a sample's options; else as `read_material`."""
    check_crop(options.crop)
    check_resize(options.resize)
    normal = options.normal
    if normal is not None and not (isinstance(normal, str) and normal in ("gl", "dx")):
        raise InputError(f"normal is {normal!r}; allowed: gl (green upward) or dx (green downward)")
    profiles = [] if notes is None else notes
    named, found, remarks = _files(source, options.maps or {})
    read = _parts(found, normal, remarks, profiles) | _parts(named, normal, remarks, profiles)
    unsaid = normal is None and "normal" in named | found
    if "albedo" not in read:
        raise InputError(f"material has no albedo; it has: {', '.join(read) or 'no maps'}")
    height, width = read["albedo"].shape[:2]
    for role, pixels in read.items():
        if not _fits(pixels.shape[0], pixels.shape[1], height, width):
            raise InputError(
                f"{role} is {pixels.shape[1]}x{pixels.shape[0]} pixels; "
                f"allowed: {width}x{height} as the albedo, or a whole multiple or fraction of both"
            )
    if options.use is not None:
        read["albedo"], used = read_used(options.use, read["albedo"], notes=profiles)
        shown = {role: on_shape(used, *pixels.shape[:2]) for role, pixels in read.items()}
        read = {role: filled(pixels, shown[role]) for role, pixels in read.items()}
        read["used"] = as_map(used)
    read = {role: resampled(role, pixels, height=height, width=width) for role, pixels in read.items()}
    if unsaid and "height" in read and points_down(read["normal"], read["height"]):
        read["normal"] = _green_turned(read["normal"])
        remarks.append(
            "the normal map's green points down (DirectX), as the height map shows; if not: --normal gl"
        )
    read = finished(cut_out(read, options), options, remarks)
    white = read.pop("used", None)
    return Material(read, tuple(remarks), None if white is None else is_white(white))


def _files(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | FilesByRole, maps: FilesByRole
) -> tuple[dict[str, MapFile], dict[str, MapFile], list[str]]:
    """Return the files that were given by role, those found by name, and notes."""
    if isinstance(source, Mapping):
        return _by_role({**source, **maps}, []), {}, []
    if isinstance(source, Sequence) and not isinstance(source, (str, bytes)):
        files = [map_file(Path(path_text(path, "map"))) for path in source]
    else:
        place = Path(path_text(source, "material"))
        files = zip_images(place) if is_zip(place) else folder_images(place)
    named = _by_role(maps, files)
    chosen = {file.place for file in named.values()}
    taken = {family_of(role) for role in named}
    rest = [file for file in files if file.place not in chosen]
    return named, *find_maps(rest, taken=taken)


def _by_role(given: FilesByRole, files: Sequence[MapFile]) -> dict[str, MapFile]:
    """Return files by role; `files` can be named without their folder."""
    found: dict[str, MapFile] = {}
    names = {file.name: file for file in files}
    for name, path in given.items():
        role = role_of(name) if isinstance(name, str) else None
        if role is None or role == LEFT_OUT:
            raise InputError(
                f"role {name!r} is unknown; {nearest(str(name), ROLES)}, or packed: orm, arm, rma …"
            )
        if role in found:
            raise InputError(f"material has two files of role {role!r}")
        shown = path_text(path, role)
        found[role] = names[shown] if shown in names and not Path(path).exists() else map_file(Path(path))
    return found


def _parts(
    files: Mapping[str, MapFile], normal: str | None, notes: list[str], profiles: Notes
) -> dict[str, PixelArray]:
    """Return the maps that files hold, separate ones rather than packed ones, and add to the notes."""
    own: dict[str, PixelArray] = {}
    packed: dict[str, PixelArray] = {}
    for role, file in files.items():
        into = packed if packed_parts(role) else own
        for name, part in _taken_apart(role, file, normal, notes, profiles):
            if name in into:
                raise InputError(f"material has two files of role {name!r}: the other one is {file.name!r}")
            into[name] = part
    return packed | own


def _taken_apart(
    role: str, file: MapFile, normal: str | None, notes: list[str], profiles: Notes
) -> Iterator[tuple[str, PixelArray]]:
    """Yield the maps that a file holds, in the form that `Material` needs."""
    pixels = file.read(colors=role in COLORS, notes=profiles)
    alpha = alpha_channel(pixels.shape[2])
    plain = pixels if alpha is None else pixels[:, :, :alpha]
    parts = packed_parts(role)
    if family_of(role) == "normal" and plain.shape[2] != 3:
        raise InputError(f"normal {file.name!r} has {pixels.shape[2]} channels; allowed: RGB")
    if pixels.shape[2] < len(parts) or (parts and plain.shape[2] != 3):
        allowed = "RGB" if len(parts) == 3 else "RGB and alpha"
        raise InputError(f"packed {file.name!r} has {pixels.shape[2]} channels; allowed: {allowed}")
    if parts:
        notes.append(f"{file.name!r} holds {', '.join(part or 'nothing' for part in parts)} in its channels")
    for k, part in enumerate(parts):
        if part:
            yield family_of(part), _single(part, pixels[:, :, k : k + 1])
    match role:
        case _ if parts:
            pass
        case "albedo":
            yield role, pixels
        case "emission":
            yield role, plain
        case "normal" | "normal_gl" | "normal_dx":
            down = normal == "dx" or (normal is None and role == "normal_dx")
            yield "normal", _green_turned(plain) if down else plain
        case "opacity" if alpha is not None and (np.ptp(pixels[:, :, alpha]) or _is_colored(plain)):
            notes.append(f"{file.name!r} has an alpha, which is read as the opacity")
            yield role, pixels[:, :, alpha:]
        case _:
            if _is_colored(plain):
                notes.append(
                    f"{file.name!r} is coloured, but read as {family_of(role)} only; if it is packed, "
                    f"name its channels in order: --map orm={file.name}"
                )
            yield family_of(role), _single(role, _grey(plain))


def _is_colored(plain: PixelArray) -> bool:
    return plain.shape[2] == 3 and float(np.ptp(to_unit(plain), axis=2).mean()) > _COLORED


def _single(role: str, values: PixelArray) -> PixelArray:
    """Return a map of single numbers, gloss as roughness."""
    return (top_of(values.dtype) - values).astype(values.dtype) if role == "gloss" else values


def _green_turned(normal: PixelArray) -> PixelArray:
    turned = normal.copy()
    turned[:, :, 1] = top_of(turned.dtype) - turned[:, :, 1]
    return turned


def _grey(pixels: PixelArray) -> PixelArray:
    mean = pixels.mean(axis=2, keepdims=True, dtype=np.float64)
    grey: PixelArray = (mean if pixels.dtype.kind == "f" else np.rint(mean)).astype(pixels.dtype)
    return grey


def _fits(height: int, width: int, to_height: int, to_width: int) -> bool:
    if height >= to_height:
        return height % to_height == 0 and width == height // to_height * to_width
    return to_height % height == 0 and to_width == to_height // height * width
