"""Finding a material's files in a folder, or in a zip file, which is read without unpacking it to disk."""

import os
import stat
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.base.zip_files import open_zip, unpacked
from upholster.image.files.read import read_image, read_image_data
from upholster.image.files.write import IMAGE_SUFFIXES
from upholster.image.profiles import Notes
from upholster.image.roles import LEFT_OUT, role_of

__all__ = ["MapFile", "folder_images", "is_zip", "map_file", "unpacked_parts", "zip_entries", "zip_images"]

MOST_BYTES = 1 << 28
"""Limit for one image in a zip file, checked before it is decoded."""


@dataclass(frozen=True, slots=True)
class MapFile:
    """A file that may be a map.

    Attributes
    ----------
    name
        Without folders; its words give the role.
    place
        The file's path; in a zip file, the path inside it.
    read
        Reads its pixels, see `upholster.image.files.read.read_image`.
    """

    name: str
    place: str
    read: Callable[..., PixelArray]


def is_zip(path: str | os.PathLike[str]) -> bool:
    """Return whether a path names a zip file; it need not exist."""
    return Path(path).suffix.lower() == ".zip"


def map_file(path: Path) -> MapFile:
    """Return a file that is not in a zip file."""
    return MapFile(path.name, str(path), partial(read_image, path))


def folder_images(folder: Path) -> list[MapFile]:
    """Return the images of a folder, without those in its subfolders."""
    if not folder.is_dir():
        raise InputError(f"material {str(folder)!r} is neither a folder nor a zip file")
    try:
        return [map_file(file) for file in folder.iterdir() if file.is_file() and _is_image(file.name)]
    except OSError as error:
        raise InputError(f"material {str(folder)!r} cannot be read: {error.strerror}") from None


def zip_images(path: Path) -> list[MapFile]:
    """Return the images of a zip file, from its outermost folder in which a name gives a role.

    Raises
    ------
    InputError
        If the file is missing, damaged or no zip file; if it has more than 1000 entries, an entry with an odd
        path (absolute, with "..", a backslash or a link), or an image that is encrypted or takes more than
        256 MiB.
    """
    folders: dict[PurePosixPath, list[MapFile]] = {}
    for entry in zip_entries(path):
        place = PurePosixPath(entry.filename)
        hidden = any(part.startswith((".", "__MACOSX")) for part in place.parts)
        if hidden or entry.is_dir() or not _is_image(place.name):
            continue
        file = MapFile(place.name, entry.filename, partial(_read_entry, path, entry))
        folders.setdefault(place.parent, []).append(file)
    for folder in sorted(folders, key=lambda folder: (len(folder.parts), folder)):
        if any(role_of(PurePosixPath(file.name).stem) not in (None, LEFT_OUT) for file in folders[folder]):
            return folders[folder]
    return [file for files in folders.values() for file in files]


def _is_image(name: str) -> bool:
    return PurePosixPath(name).suffix.lower() in IMAGE_SUFFIXES


def zip_entries(path: Path) -> list[zipfile.ZipInfo]:
    """Return a zip file's entries, all of them checked.

    Raises
    ------
    InputError
        If the file is missing, damaged or no zip file; if it has more than 1000 entries, or an entry with an
        odd path: absolute, with "..", a backslash or a link.
    """
    name = str(path)
    try:
        with open_zip(path) as package:
            entries = package.infolist()
    except FileNotFoundError:
        raise InputError(f"{name!r} does not exist; allowed: a zip file of a material") from None
    except OSError as error:
        raise InputError(f"{name!r} cannot be read: {error.strerror}") from None
    except InputError as error:
        raise InputError(f"{name!r}: {error}") from None
    for entry in entries:
        place = PurePosixPath(entry.orig_filename)
        mode = entry.external_attr >> 16
        odd = place.is_absolute() or ".." in place.parts or any(c in entry.orig_filename for c in "\\:\0")
        if odd or stat.S_ISLNK(mode):
            raise InputError(f"{name!r} has an entry {entry.orig_filename!r}; allowed: plain relative paths")
    return entries


def unpacked_parts(path: Path, entry: zipfile.ZipInfo, most: int) -> Iterator[bytes]:
    """Yield an entry's bytes in parts; never more than its declared size, `entry.file_size`.

    Raises
    ------
    InputError
        If it is encrypted, damaged, larger than `most` bytes, or packed by another method than deflate.
    """
    try:
        with open_zip(path) as package:
            yield from unpacked(package, entry, most)
    except (InputError, OSError) as error:
        raise InputError(f"{f'{path}/{entry.filename}'!r}: {error}") from None


def _read_entry(
    path: Path, entry: zipfile.ZipInfo, *, colors: bool = True, notes: Notes | None = None
) -> PixelArray:
    """Decode one image. OpenImageIO reads files only, so the bytes go through a file in memory."""
    shown = f"{path}/{entry.filename}"
    data = b"".join(unpacked_parts(path, entry, MOST_BYTES))
    return read_image_data(data, shown, colors=colors, notes=notes)
