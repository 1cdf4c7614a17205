"""A session's folder: uploaded files, in numbered folders, and files made from them."""

import os
import re
import secrets
import shutil
import tempfile
import threading
import zipfile
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from upholster.base.display import in_bytes
from upholster.base.errors import InputError
from upholster.base.examples import included_models, included_samples
from upholster.base.formats import MODEL_SUFFIXES, PROJECT_SUFFIX, SURFACE_SUFFIXES
from upholster.image.files.packages import unpacked_parts, zip_entries
from upholster.image.files.write import IMAGE_SUFFIXES

__all__ = ["INCLUDED", "MADE", "Folder", "file_kind"]

INCLUDED = "included"
"""The folder of samples and models that are included with the program."""

MADE = ".made"
"""A file in groups of files that the user does not have under these names: pasted, renamed, unpacked."""

_PHOTOS = (*IMAGE_SUFFIXES, ".heic", ".heif", ".avif")
_MOST_FILES = 1000
_MOST_FOLDERS = 8
_MOST_NAME = 200
"""Most bytes of a file's name: systems allow 255, and temporary names are longer."""

_SHARE = 8
"""All files together may be this many times as large as one file."""

_PREFIX = "upholster-studio-"

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
        _remove_abandoned()
        self.path = Path(os.path.realpath(tempfile.mkdtemp(prefix=_PREFIX)))
        self._lock = _locked(self.path)
        self.most_bytes = most_bytes
        self._bytes = 0
        self._counting = threading.Lock()
        self._groups = 0
        for file in (*included_samples().values(), *included_models().values()):
            target = self.path / INCLUDED / file.name
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(file, target)

    def close(self) -> None:
        """Delete it."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

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
        with suppress(OSError, ValueError):  # too long, or with characters that no name has
            place = Path(os.path.realpath(self.path / name))
            if place.is_relative_to(self.path) and place != self.path and place.exists():
                return place
        raise InputError(f"{name!r} does not exist; allowed: files that were dropped here")

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
        group_folder = self.path / str(number)
        if sum(one.is_file() for one in group_folder.rglob("*")) >= _MOST_FILES:
            raise InputError(f"{name!r} is one file too many; allowed: {_MOST_FILES} together")
        own = [one for one in folder.split("/") if one.strip(". ")][:_MOST_FOLDERS]
        own.append(re.split(r"[/\\]", name)[-1])
        target = group_folder.joinpath(*map(_safe, own))
        with self._new_file(target, name) as write:
            async for part in parts:
                write(part)
        if is_made or own != [_safe(one) for one in own]:
            (group_folder / MADE).touch()
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
        """Replace a zip of a project by its files, in a new group.

        Returns
        -------
        str or None
            The project's path; None if the zip holds no project.

        Raises
        ------
        InputError
            If it is damaged, or too large: then it does not stay, nor any of its files.
        """
        place = self.inside(name)
        is_material = False
        try:
            entries = [one for one in zip_entries(place) if not one.is_dir()]
            projects = [one.filename for one in entries if file_kind(one.filename) == "project"]
            is_material = not projects
            return None if is_material else f"{self._unpack(place, entries)}/{projects[0]}"
        except InputError as error:
            raise InputError(str(error).replace(f"{place.parent}{os.sep}", "")) from None
        finally:
            if not is_material:
                self._remove(place)

    def _unpack(self, place: Path, entries: list[zipfile.ZipInfo]) -> int:
        """Unpack a zip's entries into a new group; return the group."""
        for one in entries:  # their declared sizes: more is never unpacked
            self.check(one.filename, one.file_size)
        self._check_together(place.name, sum(one.file_size for one in entries))
        number = self.new_group()
        folder = self.path / str(number)
        try:
            for one in entries:
                with self._new_file(folder / one.filename, one.filename) as write:
                    for part in unpacked_parts(place, one, one.file_size):
                        write(part)
            (folder / MADE).touch()
        except BaseException:
            self._remove(folder)
            raise
        return number

    @contextmanager
    def _new_file(self, target: Path, name: str) -> Iterator[Callable[[bytes], None]]:
        """Write a file part by part. Each part counts as it comes; of a file that fails nothing stays."""
        size = 0
        partial = target.with_name(f".{secrets.token_hex(8)}.part")

        def write(part: bytes) -> None:
            nonlocal size
            self._check_one(name, size + len(part))
            self._check_together(name, len(part))
            self._count(len(part))
            size += len(part)
            file.write(part)

        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with partial.open("wb") as file:
                yield write
            replaced = target.stat().st_size if target.is_file() else 0
            os.replace(partial, target)
            self._count(-replaced)
        except BaseException as error:
            self._count(-size)
            with suppress(OSError):
                partial.unlink()
            if isinstance(error, OSError):
                raise InputError(f"{name!r} cannot be kept: {error.strerror or error}") from None
            raise

    def _remove(self, place: Path) -> None:
        files = [one for one in (place, *place.rglob("*")) if one.is_file()]
        self._count(-sum(one.stat().st_size for one in files))
        if place.is_dir():
            shutil.rmtree(place)
        else:
            place.unlink()

    def _count(self, size: int) -> None:
        with self._counting:
            self._bytes += size

    def check(self, name: str, size: int) -> None:
        """Raise InputError unless a file of this size can be added."""
        self._check_one(name, size)
        self._check_together(name, size)

    def _check_one(self, name: str, size: int) -> None:
        if size > self.most_bytes:
            raise InputError(f"{name!r} is too large; allowed: {in_bytes(self.most_bytes)} (--limit)")

    def _check_together(self, name: str, size: int) -> None:
        if self._bytes + size > _SHARE * self.most_bytes:
            raise InputError(f"{name!r} is too much; allowed: {in_bytes(_SHARE * self.most_bytes)} together")


def _locked(folder: Path) -> int | None:
    """Return the descriptor of a folder, locked until this process ends; None if it is locked already."""
    try:
        import fcntl
    except ImportError:  # on Windows, where abandoned folders stay
        return None
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _remove_abandoned() -> None:
    """Remove the folders of sessions that were killed."""
    for place in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        # A folder that is still empty may be of a session that begins.
        with suppress(OSError):
            if os.listdir(place) and (descriptor := _locked(place)) is not None:
                shutil.rmtree(place, ignore_errors=True)
                os.close(descriptor)


def _safe(name: str) -> str:
    """Return a plain file name for a name from any operating system."""
    base = re.sub(r"[^\w.=+,@ ()#-]", "_", re.split(r"[/\\]", name)[-1]).strip(". ")
    return base.encode()[-_MOST_NAME:].decode(errors="ignore") or "file"


def _references(file: Path) -> Iterator[Path]:
    """Yield the files that a model refers to."""
    if file.suffix.lower() in (".gltf", ".obj"):
        kept = (".bin", ".mtl", *IMAGE_SUFFIXES)
        yield from (one for one in file.parent.iterdir() if one.suffix.lower() in kept and one.is_file())
