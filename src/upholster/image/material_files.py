"""Reading materials: which map a file holds, maps of other sizes, of other conventions, packed ones."""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from upholster.errors import InputError, nearest
from upholster.files import path_text
from upholster.image.color import alpha_channel
from upholster.image.material import COLORS, Material, top_of
from upholster.image.preparing import check_crop, check_resize, cut_out, finished, resampled
from upholster.image.profiles import Notes
from upholster.image.read import read_image
from upholster.image.rectify import Corners
from upholster.image.roles import ROLES, find_maps, role_of
from upholster.options import SampleOptions
from upholster.types import PixelArray

__all__ = ["read_material"]


def read_material(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | Mapping[str, str | os.PathLike[str]],
    *,
    rectify: Corners | None = None,
    crop: tuple[int, int, int, int] | None = None,
    resize: int | str | tuple[int, int] | None = None,
    even_light: bool = False,
    notes: Notes | None = None,
) -> Material:
    """Read a material from its maps' files.

    Parameters
    ----------
    source
        A folder, or files, told apart by their names (``brick_albedo.png``, ``brick_nor_gl_1k.png``,
        ``Bricks102_4K-JPG_Roughness.jpg``; see `upholster.image.roles.role_of`); or files by role.
    rectify, crop, resize, even_light, notes
        As for `upholster.read_exemplar`, in pixels of the albedo, for all maps alike; even light for the
        albedo alone. Normals turn and stretch with a rectified map.

    Returns
    -------
    Material
        Maps whose sides are a whole multiple or a whole fraction of the albedo's are resampled to it. Normal
        maps in DirectX' convention have their green turned round; gloss becomes roughness; packed images
        (occlusion, roughness, metallic) are taken apart, maps of their own going before.

    Raises
    ------
    InputError
        If a file cannot be read, has an unknown role, the role of another one, or a shape that does not fit;
        if there is no albedo; for a crop or a size outside the limits of `read_exemplar`.
    """
    check_crop(crop)
    check_resize(resize)
    own: dict[str, PixelArray] = {}
    packed: dict[str, PixelArray] = {}
    for role, path in _files(source).items():
        for name, part in _taken_apart(role, read_image(path, colors=role in COLORS, notes=notes), path.name):
            if name in own and role != "arm":
                raise InputError(f"material has two files of role {name!r}: the other one is {path.name!r}")
            (packed if role == "arm" else own)[name] = part
    read = packed | own
    if "albedo" not in read:
        raise InputError(f"material has no albedo; it has: {', '.join(read) or 'no maps'}")
    height, width = read["albedo"].shape[:2]
    for role, pixels in read.items():
        if not _fits(pixels.shape[0], pixels.shape[1], height, width):
            raise InputError(
                f"{role} is {pixels.shape[1]}x{pixels.shape[0]} pixels; "
                f"allowed: {width}x{height} as the albedo, or a whole multiple or fraction of both"
            )
    maps = {role: resampled(role, pixels, height=height, width=width) for role, pixels in read.items()}
    options = SampleOptions(rectify=rectify, crop=crop, resize=resize, even_light=even_light)
    return Material(finished(cut_out(maps, options), options))


def _files(
    source: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | Mapping[str, str | os.PathLike[str]],
) -> dict[str, Path]:
    if isinstance(source, Mapping):
        found: dict[str, Path] = {}
        for name, path in source.items():
            role = role_of(name) if isinstance(name, str) else None
            if role is None:
                raise InputError(f"role {name!r} is unknown; {nearest(str(name), ROLES)}")
            if role in found:
                raise InputError(f"material has two files of role {role!r}")
            found[role] = Path(path_text(path, role))
        return found
    if isinstance(source, Sequence) and not isinstance(source, (str, bytes)):
        return find_maps(Path(path_text(path, "map")) for path in source)
    folder = Path(path_text(source, "material"))
    if not folder.is_dir():
        raise InputError(f"material {os.fspath(source)!r} is no folder")
    try:
        return find_maps(file for file in folder.iterdir() if file.is_file())
    except OSError as error:
        raise InputError(f"material {os.fspath(source)!r} cannot be read: {error.strerror}") from None


def _taken_apart(role: str, pixels: PixelArray, name: str) -> Iterator[tuple[str, PixelArray]]:
    """Yield the maps that a file holds, as `Material` wants them."""
    alpha = alpha_channel(pixels.shape[2])
    plain = pixels if alpha is None else pixels[:, :, :alpha]
    if role in ("normal", "normal_dx", "arm") and plain.shape[2] != 3:
        raise InputError(f"{role} {name!r} has {pixels.shape[2]} channels; allowed: RGB")
    match role:
        case "albedo":
            yield role, pixels
        case "emission" | "normal":
            yield role, plain
        case "normal_dx":
            plain = plain.copy()
            plain[:, :, 1] = top_of(plain.dtype) - plain[:, :, 1]
            yield "normal", plain
        case "arm":
            for k, part in enumerate(("ao", "roughness", "metallic")):
                yield part, plain[:, :, k : k + 1]
        case "gloss":
            yield "roughness", (top_of(plain.dtype) - _grey(plain)).astype(plain.dtype)
        case _:
            yield role, _grey(plain)


def _grey(pixels: PixelArray) -> PixelArray:
    mean = pixels.mean(axis=2, keepdims=True, dtype=np.float64)
    grey: PixelArray = (mean if pixels.dtype.kind == "f" else np.rint(mean)).astype(pixels.dtype)
    return grey


def _fits(height: int, width: int, to_height: int, to_width: int) -> bool:
    if height >= to_height:
        return height % to_height == 0 and width == height // to_height * to_width
    return to_height % height == 0 and to_width == to_height // height * width
