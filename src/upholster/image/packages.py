"""Finding a material's files in a folder, or in a zip file, which is read without unpacking it to disk."""

import io
import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from upholster.errors import InputError
from upholster.image.profiles import Notes
from upholster.image.read import read_image, read_image_data
from upholster.image.roles import LEFT_OUT, role_of
from upholster.image.write import IMAGE_SUFFIXES
from upholster.types import PixelArray

__all__ = ["MapFile", "folder_images", "is_zip", "map_file", "unpacked_parts", "zip_entries", "zip_images"]

MOST_ENTRIES = 1000
MOST_BYTES = 1 << 28
"""Limit for one image in a zip file, checked before it is decoded."""

_MOST_DIRECTORY = MOST_ENTRIES << 10
"""Largest directory of a zip file, in bytes: `zipfile` would read one of any size."""

_PART = 1 << 16


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
        Reads its pixels, see `upholster.image.read.read_image`.
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
        with _Directory(path) as file, zipfile.ZipFile(file) as package:
            entries = package.infolist()
    except FileNotFoundError:
        raise InputError(f"{name!r} does not exist") from None
    except OSError as error:
        raise InputError(f"{name!r} cannot be read: {error.strerror}") from None
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise InputError(f"{name!r} is not a readable zip file: {error}") from None
    if len(entries) > MOST_ENTRIES:
        raise InputError(f"{name!r} has {len(entries)} entries; allowed: {MOST_ENTRIES}")
    for entry in entries:
        place = PurePosixPath(entry.orig_filename)
        mode = entry.external_attr >> 16
        odd = place.is_absolute() or ".." in place.parts or any(c in entry.orig_filename for c in "\\:\0")
        if odd or stat.S_ISLNK(mode):
            raise InputError(f"{name!r} has an entry {entry.orig_filename!r}; allowed: plain relative paths")
    return entries


class _Directory(io.FileIO):
    """A zip file whose directory is read, unless it is too large. Its length is stored in several places."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > _MOST_DIRECTORY:
            raise InputError(f"{self.name!r} lists {size:,} bytes of entries; allowed: {_MOST_DIRECTORY:,}")
        return super().read(size) or b""


def unpacked_parts(path: Path, entry: zipfile.ZipInfo) -> Iterator[bytes]:
    """Yield an entry's bytes in parts; never more than its declared size, `entry.file_size`.

    Raises
    ------
    InputError
        If it is encrypted, packed by another method than deflate, or damaged.
    """
    shown = f"{path}/{entry.filename}"
    if entry.flag_bits & 1:
        raise InputError(f"{shown!r} is encrypted; allowed: plain entries")
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(f"{shown!r} is packed by method {entry.compress_type}; allowed: stored, deflate")
    try:
        with zipfile.ZipFile(path) as package, package.open(entry) as stream:
            while part := stream.read(_PART):
                yield part
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, EOFError, OSError) as error:
        raise InputError(f"{shown!r} cannot be unpacked: {error}") from None


def _read_entry(
    path: Path, entry: zipfile.ZipInfo, *, colors: bool = True, notes: Notes | None = None
) -> PixelArray:
    """Decode one image. OpenImageIO reads files only, so the bytes go through a file in memory."""
    shown = f"{path}/{entry.filename}"
    if entry.file_size > MOST_BYTES:
        raise InputError(
            f"{shown!r} takes {entry.file_size >> 20} MiB; allowed: {MOST_BYTES >> 20} MiB unpacked"
        )
    data = b"".join(unpacked_parts(path, entry))
    return read_image_data(data, shown, colors=colors, notes=notes)
