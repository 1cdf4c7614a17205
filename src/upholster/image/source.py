"""What a user names as the exemplar: an image, or a material in one of several forms."""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from upholster.errors import InputError
from upholster.image.material import Material
from upholster.image.material_files import read_material
from upholster.image.read import _parse_resize, read_exemplar
from upholster.image.write import IMAGE_SUFFIXES
from upholster.types import PixelArray

__all__ = ["Source", "read_source", "source_files", "source_names", "source_parts"]

Source = (
    str
    | os.PathLike[str]
    | Sequence[str | os.PathLike[str]]
    | Mapping[str, str | os.PathLike[str]]
    | Material
)
"""An image's file; or a material, its folder, its files, or its files by role."""


def read_source(
    source: Source, *, crop: tuple[int, int, int, int] | None = None, resize: str | None = None
) -> PixelArray | Material:
    """Read an exemplar.

    Parameters
    ----------
    source
        One file is an image, whatever its name says; all else is a material, see `read_material`.
    crop, resize
        As for `read_exemplar`; not for a material that has been read already.

    Raises
    ------
    InputError
        As `read_exemplar` and `read_material`; if one of several files is no image.
    """
    if isinstance(source, Material):
        if crop is not None or resize is not None:
            raise InputError("crop and resize are for files; a material is used as it is")
        return source
    if isinstance(source, Sequence) and not isinstance(source, str):
        if len(source) == 1:
            return read_source(source[0], crop=crop, resize=resize)
        for file in source:
            # In a folder such files are skipped; one that is named is wanted.
            if Path(file).suffix.lower() not in IMAGE_SUFFIXES:
                raise InputError(f"map {os.fspath(file)!r} is no image; allowed: {', '.join(IMAGE_SUFFIXES)}")
    sides = None if resize is None else _parse_resize(resize)
    if not isinstance(source, (str, os.PathLike)):
        return read_material(source, crop=crop, resize=sides)
    if not os.path.isdir(source):
        return read_exemplar(source, crop=crop, resize=resize)
    try:
        return read_material(source, crop=crop, resize=sides)
    except InputError as error:
        raise InputError(f"folder {os.fspath(source)!r}: {error}") from None


def source_files(source: Source) -> list[str]:
    """Return the files that an exemplar is read from, of a folder all images: any may be one of its maps.

    What does not exist is left out; `read_source` reports it.
    """
    if isinstance(source, Material):
        return []
    if isinstance(source, Mapping):
        return [os.fspath(file) for file in source.values()]
    given = [source] if isinstance(source, (str, os.PathLike)) else list(source)
    files = [os.fspath(file) for file in given]
    if len(files) != 1 or not os.path.isdir(files[0]):
        return files
    with suppress(OSError):
        return [str(file) for file in Path(files[0]).iterdir() if file.suffix.lower() in IMAGE_SUFFIXES]
    return []


def source_parts(exemplar: PixelArray | Material) -> dict[str, PixelArray]:
    """Return by role what is painted: the base colour first, under "albedo", the opacity in its alpha."""
    if not isinstance(exemplar, Material):
        return {"albedo": exemplar}
    others = {role: pixels for role, pixels in exemplar.maps.items() if role not in ("albedo", "opacity")}
    return {"albedo": exemplar.color(), **others}


def source_names(source: Source) -> Any:
    """Return an exemplar's files as JSON can hold them."""
    if isinstance(source, Material):
        return f"a material: {', '.join(source.maps)}"
    if isinstance(source, Mapping):
        return {role: os.fspath(file) for role, file in source.items()}
    return os.fspath(source) if isinstance(source, (str, os.PathLike)) else [os.fspath(f) for f in source]
