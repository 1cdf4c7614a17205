"""A folder on a disk, or at a URL that fsspec opens, in which every file is complete or absent."""

import importlib
import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upholster.base.errors import InputError
from upholster.base.files import write_bytes

__all__ = ["Place", "is_url"]


def is_url(text: str) -> bool:
    """Return whether a name is a URL, ``s3://bucket/wall``, and not a path."""
    return "://" in text


@dataclass(frozen=True, slots=True)
class Place:
    """A folder: a path, or a URL as fsspec takes it.

    Attributes
    ----------
    folder
        Path or URL, without a slash at its end.
    """

    folder: str

    @property
    def _system(self) -> Any:
        """The file system of the URL."""
        try:
            fsspec = importlib.import_module("fsspec")
        except ImportError:
            raise InputError(
                f"{self.folder!r} is a URL, which needs fsspec; install it by: pip install "
                '"upholster[cluster]"'
            ) from None
        try:
            return fsspec.url_to_fs(self.folder)[0]
        except (ImportError, ValueError, OSError) as error:
            raise InputError(f"{self.folder!r} cannot be opened: {error}") from None

    def file(self, name: str) -> str:
        """Return path or URL of a file in this folder."""
        return f"{self.folder}/{name}" if self.folder else name

    def inside(self, name: str) -> "Place":
        """Return a folder in this folder."""
        return Place(self.file(name))

    def make(self) -> None:
        """Create the folder, and check that files can be written to it.

        Raises
        ------
        InputError
            If they cannot be written.
        """
        if not is_url(self.folder):
            try:
                os.makedirs(self.folder, exist_ok=True)
            except OSError as error:
                raise InputError(f"{self.folder!r} cannot be made: {error.strerror}") from None
        probe = f".upholster-probe-{secrets.token_hex(4)}"
        self.write(probe, b"")
        self.remove(probe)

    def names(self) -> set[str]:
        """Return the names of all files and folders in it; none if it does not exist."""
        try:
            if is_url(self.folder):
                found = self._system.ls(self.folder, detail=False, refresh=True)
                return {os.path.basename(name.rstrip("/")) for name in found}
            return set(os.listdir(self.folder))
        except FileNotFoundError:
            return set()
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"{self.folder!r} cannot be read: {_why(error)}") from None

    def size(self, name: str) -> int:
        """Return the size of a file in bytes; −1 if it does not exist."""
        with suppress(Exception):  # of any kind that a file system raises
            if is_url(self.folder):
                return int(self._system.size(self.file(name)))
            return os.path.getsize(self.file(name))
        return -1

    def read(self, name: str) -> bytes:
        """Return the content of a file.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        try:
            if is_url(self.folder):
                data: bytes = self._system.cat_file(self.file(name))
                return data
            return Path(self.file(name)).read_bytes()
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"{self.file(name)!r} cannot be read: {_why(error)}") from None

    def write(self, name: str, data: bytes) -> int:
        """Write a file, which is there completely or not at all; return its size. Errors as for `writing`.

        It need not survive a loss of power, because readers check its size.
        """
        with self.writing(name, durable=False) as path:
            write_bytes(path, data)
        return len(data)

    @contextmanager
    def writing(self, name: str, *, durable: bool = True) -> Iterator[Path]:
        """Yield a path at which to write a file; when the body ends, the complete file gets its name.

        If it is `durable`, its data is on the disk before that.

        Raises
        ------
        InputError
            If it cannot be written: the disk is full, the URL is not writable.
        """
        part = f".upholster-{os.getpid()}-{secrets.token_hex(4)}{Path(name).suffix}"
        path = Path(tempfile.gettempdir() if is_url(self.folder) else self.folder or ".", part)
        try:
            yield path
            if is_url(self.folder):
                self._send(path, part, name)
            else:
                if durable:
                    with path.open("rb+") as opened:
                        os.fsync(opened.fileno())
                os.replace(path, self.file(name))
        except InputError as error:
            raise InputError(str(error).replace(os.fspath(path), self.file(name))) from None
        except OSError as error:
            raise InputError(f"{self.file(name)!r} cannot be written: {_why(error)}") from None
        finally:
            with suppress(OSError):
                path.unlink()

    def _send(self, path: Path, part: str, name: str) -> None:
        system = self._system
        try:
            with suppress(NotImplementedError, FileExistsError):
                system.makedirs(self.folder, exist_ok=True)
            system.put_file(os.fspath(path), self.file(part))
            system.mv(self.file(part), self.file(name))
        except Exception as error:  # each file system raises its own kinds
            with suppress(Exception):
                system.rm_file(self.file(part))
            raise InputError(f"{self.file(name)!r} cannot be written: {_why(error)}") from None

    def remove(self, name: str) -> None:
        """Remove a file; if it does not exist, do nothing."""
        with suppress(Exception):
            if is_url(self.folder):
                self._system.rm_file(self.file(name))
            else:
                os.unlink(self.file(name))

    def remove_all(self) -> None:
        """Remove the folder and the files in it."""
        for name in self.names():
            self.remove(name)
        with suppress(Exception):
            if is_url(self.folder):
                self._system.rmdir(self.folder)
            else:
                os.rmdir(self.folder)


def _why(error: Exception) -> str:
    text = getattr(error, "strerror", None) or " ".join(str(error).split())
    return text or type(error).__name__
