"""A session's folder: uploaded files, in numbered folders, and files made from them."""

import os
import re
import shutil
import tempfile
import zipfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from upholster.errors import InputError
from upholster.formats import MODEL_SUFFIXES, PROJECT_SUFFIX, SURFACE_SUFFIXES
from upholster.image.write import IMAGE_SUFFIXES
from upholster.included import included_models, included_samples
from upholster.shown import in_bytes

__all__ = ["INCLUDED", "MADE", "Folder", "file_kind"]

INCLUDED = "included"
"""The folder of samples and models that are included with the program."""

MADE = ".made"
"""A file in groups of files that the user does not have under these names: pasted, renamed, unpacked."""

_PHOTOS = (*IMAGE_SUFFIXES, ".heic", ".heif", ".avif")
_MOST_FILES = 1000
_MOST_FOLDERS = 8
_MOST_NAME = 120
_SHARE = 8
"""All files together may be this many times as large as one file."""

_MODELS = (*MODEL_SUFFIXES, *SURFACE_SUFFIXES)


def file_kind(name: str) -> str:
    """Return a file's kind by its name: "project", "model", "image", "material" (a zip), "other"."""
    lower = name.lower()
    if lower.endswith(PROJECT_SUFFIX):
        return "project"
    if lower.endswith(_MODELS):
        return "model"
    if lower.endswith(_PHOTOS):
        return "image"
    return "material" if lower.endswith(".zip") else "other"


class Folder:
    """Holds a session's files until `close`.

    Parameters
    ----------
    most_bytes
        Largest size of one file; all together may have eight times as many.

    Attributes
    ----------
    path
        Readable by the user only (mode 0700).
    """

    def __init__(self, most_bytes: int) -> None:
        self.path = Path(os.path.realpath(tempfile.mkdtemp(prefix="upholster-studio-")))
        self.most_bytes = most_bytes
        self._bytes = 0
        self._groups = 0
        for file in (*included_samples().values(), *included_models().values()):
            target = self.path / INCLUDED / file.name
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(file, target)

    def close(self) -> None:
        """Delete it."""
        shutil.rmtree(self.path, ignore_errors=True)

    def included(self, kind: str) -> list[str]:
        """Return the paths of the included files of a kind, as states name them."""
        inside = (self.path / INCLUDED).glob("*")
        return sorted(f"{INCLUDED}/{file.name}" for file in inside if file_kind(file.name) == kind)

    def new_group(self) -> int:
        """Return the number of a new, empty group."""
        self._groups += 1
        (self.path / str(self._groups)).mkdir()
        return self._groups

    def inside(self, name: str) -> Path:
        """Return a file or folder of the session.

        Raises
        ------
        InputError
            If it does not exist, or is outside the session's folder.
        """
        place = Path(os.path.realpath(self.path / name)) if "\0" not in name else self.path
        if not place.is_relative_to(self.path) or place == self.path or not place.exists():
            raise InputError(f"{name!r} does not exist; allowed: files that were dropped here")
        return place

    async def store(
        self,
        parts: AsyncIterator[bytes],
        name: str,
        group: int | None,
        *,
        folder: str = "",
        is_made: bool = False,
    ) -> tuple[int, str]:
        """Receive a file; return its group (a new one if None is given) and its path.

        `folder` is where the file was in a dropped folder; `is_made` says that the user has no such file.

        Raises
        ------
        InputError
            If it is too large, or there are too many.
        """
        if group is not None and not 1 <= group <= self._groups:
            raise InputError(f"group is {group}; allowed: one that was made")
        number = group or self.new_group()
        own = [one for one in folder.split("/") if one.strip(". ")][:_MOST_FOLDERS]
        own.append(re.split(r"[/\\]", name)[-1])
        target = self.path.joinpath(str(number), *map(_safe, own))
        target.parent.mkdir(parents=True, exist_ok=True)
        if is_made or own != [_safe(one) for one in own]:
            (self.path / str(number) / MADE).touch()
        if len(list(target.parent.iterdir())) >= _MOST_FILES:
            raise InputError(f"{name!r} is one file too many; allowed: {_MOST_FILES} together")
        size = 0
        partial = target.with_name(f".{target.name}.part")
        try:
            with partial.open("wb") as file:
                async for part in parts:
                    size += len(part)
                    self.check(name, size)
                    file.write(part)
            os.replace(partial, target)
        except OSError as error:
            raise InputError(f"{name!r} cannot be kept: {error.strerror or error}") from None
        finally:
            partial.unlink(missing_ok=True)
        self._bytes += size
        return number, target.relative_to(self.path).as_posix()

    def add(self, file: str | os.PathLike[str]) -> str:
        """Copy a file or a folder of images, named at start; return its path."""
        number, given = self.new_group(), Path(file)
        if given.is_dir():
            for inner in given.iterdir():
                if inner.is_file():
                    shutil.copyfile(inner, self.path / str(number) / _safe(inner.name))
            return str(number)
        if not given.is_file():
            raise InputError(f"{os.fspath(file)!r} does not exist")
        shutil.copyfile(given, self.path / str(number) / _safe(given.name))
        for other in _references(given):
            shutil.copyfile(other, self.path / str(number) / _safe(other.name))
        return f"{number}/{_safe(given.name)}"

    def unpacked(self, name: str) -> str | None:
        """Unpack a zip of a project into a new group; return the project's path, None if it holds none.

        Raises
        ------
        InputError
            If it is damaged, or too large.
        """
        try:
            with zipfile.ZipFile(self.inside(name)) as file:
                found = [one for one in file.infolist() if file_kind(one.filename) == "project"]
                if not found:
                    return None
                number = self.new_group()
                for one in file.infolist():
                    if not one.is_dir():
                        self._unpack(file, one, self.path / str(number))
                (self.path / str(number) / MADE).touch()
                return f"{number}/{found[0].filename}"
        except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError, OSError) as error:
            raise InputError(f"{os.path.basename(name)}: it is not a readable zip file: {error}") from None

    def _unpack(self, file: zipfile.ZipFile, one: zipfile.ZipInfo, folder: Path) -> None:
        target = Path(os.path.normpath(folder / one.filename))
        if not target.is_relative_to(folder) or len(file.filelist) > _MOST_FILES:
            raise InputError(f"the zip has {one.filename!r} among {len(file.filelist)} files; allowed: fewer")
        target.parent.mkdir(parents=True, exist_ok=True)
        size = 0
        with file.open(one) as packed, target.open("wb") as out:
            while part := packed.read(1 << 16):
                size += len(part)
                self.check(one.filename, size)
                out.write(part)
        self._bytes += size

    def check(self, name: str, size: int) -> None:
        """Raise InputError unless a file of this size can be added."""
        if size > self.most_bytes:
            raise InputError(f"{name!r} is too large; allowed: {in_bytes(self.most_bytes)} (--limit)")
        if self._bytes + size > _SHARE * self.most_bytes:
            raise InputError(f"{name!r} is too much; allowed: {in_bytes(_SHARE * self.most_bytes)} together")


def _safe(name: str) -> str:
    """Return a plain file name for a name from any operating system."""
    base = re.sub(r"[^\w.=+,@ ()#-]", "_", re.split(r"[/\\]", name)[-1]).strip(". ")
    return base[-_MOST_NAME:] or "file"


def _references(file: Path) -> Iterator[Path]:
    """Yield the files that a model refers to."""
    if file.suffix.lower() in (".gltf", ".obj"):
        kept = (".bin", ".mtl", *IMAGE_SUFFIXES)
        yield from (one for one in file.parent.iterdir() if one.suffix.lower() in kept and one.is_file())
