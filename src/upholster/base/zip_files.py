"""Zip files from untrusted sources: refused before they take memory or time."""

import os
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import IO

from upholster.base.errors import InputError

__all__ = ["MOST_ENTRIES", "open_zip", "unpacked"]

MOST_ENTRIES = 1000

_MOST_DIRECTORY = MOST_ENTRIES << 10
_PIECE = 1 << 16


@contextmanager
def open_zip(source: str | os.PathLike[str] | bytes) -> Iterator[zipfile.ZipFile]:
    """Open a zip file, by its path or its contents. Its entries' names may be anything.

    Raises
    ------
    InputError
        If it is no readable zip file, or has more than 1000 entries or a directory of more than a megabyte.
    OSError
        If the file cannot be read.
    """
    with BytesIO(source) if isinstance(source, bytes) else open(source, "rb") as file:
        try:
            package = zipfile.ZipFile(_Guarded(file))
        except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError) as error:
            raise InputError(f"it is not a readable zip file: {error}") from None
        if len(package.filelist) > MOST_ENTRIES:
            raise InputError(f"it has {len(package.filelist)} entries; allowed: {MOST_ENTRIES}")
        package.fp = file
        yield package


def unpacked(package: zipfile.ZipFile, entry: zipfile.ZipInfo, most: int) -> Iterator[bytes]:
    """Yield an entry's bytes in pieces.

    Raises
    ------
    InputError
        If it is damaged or encrypted, takes more than `most` bytes, or is packed in an unusual way.
    """
    if entry.file_size > most:
        raise InputError(f"it takes {entry.file_size >> 20} MiB; allowed: {most >> 20} MiB unpacked")
    if entry.flag_bits & 1:
        raise InputError("it is encrypted; allowed: plain entries")
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise InputError(f"it is packed by method {entry.compress_type}; allowed: stored, deflate")
    try:
        with package.open(entry) as stream:  # it ends after the declared size
            while piece := stream.read(_PIECE):
                yield piece
    except (zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, EOFError, OSError) as error:
        raise InputError(f"it cannot be unpacked: {error}") from None


class _Guarded:
    """A file as `zipfile` reads it until the directory is known.

    `zipfile` reads a directory at once, with the length that the file declares in one of two records.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.seek, self.tell, self.seekable, self.close = file.seek, file.tell, file.seekable, file.close

    def read(self, size: int = -1) -> bytes:
        if size > _MOST_DIRECTORY:
            raise InputError(f"its directory has {size:,} bytes; allowed: {_MOST_DIRECTORY:,}")
        return self._file.read(size)
