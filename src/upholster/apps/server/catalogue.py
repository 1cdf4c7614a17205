"""The served streams: the given files, and the streams of the given folders. No other file can be named.

A name is a key, never a path: a request's name is looked up among the names that exist at that moment, so no
spelling of it can lead to another file.
"""

import os
import stat
import unicodedata
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from upholster.base.errors import FormatError, InputError
from upholster.base.files import MAX_BYTES, read_bytes
from upholster.codec.stream.reader import read_stream

__all__ = ["SUFFIX", "Catalogue", "ListedStream"]

SUFFIX = ".uph"


@dataclass(frozen=True, slots=True)
class ListedStream:
    """A stream as the start page lists it.

    Attributes
    ----------
    name
        Its name in addresses: unique, printable, parts joined by slashes.
    size
        Bytes.
    """

    name: str
    size: int


@dataclass(frozen=True, slots=True)
class _Given:
    path: str
    label: str
    folder: bool


class Catalogue:
    """The streams of files and folders.

    A file has its own name, preceded by as many of its folders as distinguish it from the other given ones. A
    folder contributes its ``*.uph`` files, not those of folders inside it. It is listed again at each
    request, so new files appear by themselves. If more than the one folder is given, its label precedes its
    files' names. Hidden files are left out, and so are links that lead out of the folder.

    Parameters
    ----------
    paths
        Files and folders, at least one.

    Raises
    ------
    InputError
        If one does not exist, cannot be read, or is a file with another suffix.
    FormatError
        If a file is damaged, or too short to show anything; a cut one is accepted.
    """

    def __init__(self, paths: Sequence[str]) -> None:
        if not paths:
            raise InputError("no streams are given; allowed: .uph files and folders")
        unique: dict[str, str] = {}
        for path in paths:
            if "\0" in path:
                raise InputError(f"file {path!r} contains a null character")
            unique.setdefault(os.path.abspath(path), path)
        folders = {place: _checked(path) for place, path in unique.items()}
        labels = _labels(list(unique))
        self._given = [
            _Given(place, label, folders[place]) for place, label in zip(unique, labels, strict=True)
        ]

    @property
    def folders(self) -> int:
        """Number of folders among the given paths."""
        return sum(given.folder for given in self._given)

    def entries(self) -> list[ListedStream]:
        """Return the streams that exist now: files as given, those of a folder by name."""
        found = []
        for name, path in self._places().items():
            with suppress(OSError):
                size = os.stat(path).st_size
                if size <= MAX_BYTES:
                    found.append(ListedStream(name, size))
        return found

    def find(self, name: str) -> tuple[str, os.stat_result] | None:
        """Return path and status of the stream of that name, or None if it does not exist now.

        Only regular files of at most 1 GiB are found: no link, and no pipe, which would block on opening.
        """
        path = self._places().get(name)
        if path is None:
            return None
        with suppress(OSError):
            status = os.lstat(path)
            if stat.S_ISREG(status.st_mode) and status.st_size <= MAX_BYTES:
                return path, status
        return None

    def _places(self) -> dict[str, str]:
        """Return every stream's path by name; for given links, their present targets."""
        places: dict[str, str] = {}
        own = {os.path.realpath(given.path) for given in self._given if not given.folder}
        for given in self._given:
            if not given.folder:
                _add(places, given.label, os.path.realpath(given.path))
                continue
            prefix = f"{given.label}/" if len(self._given) > 1 else ""
            for name, path in _streams(os.path.realpath(given.path)):
                if path not in own:  # it is also given by name
                    _add(places, prefix + _printable(name), path)
        return places


def _checked(path: str) -> bool:
    """Return whether `path` is a folder; raise if it is neither a readable folder nor a valid stream."""
    if os.path.isdir(path):
        try:
            os.scandir(path).close()
        except OSError as error:
            raise InputError(f"folder {path!r} cannot be read: {error.strerror}") from None
        return True
    if os.path.exists(path) and Path(path).suffix.lower() != SUFFIX:
        raise InputError(f"file {path!r} has suffix {Path(path).suffix!r}; allowed: {SUFFIX}, or a folder")
    data = read_bytes(path)
    try:
        read_stream(data, strict=False)
    except FormatError as error:
        raise FormatError(f"file {path!r}: {error}") from None
    return False


def _streams(root: str) -> Iterator[tuple[str, str]]:
    """Yield name and path of the streams directly in a folder, by name; for links their targets."""
    try:
        with os.scandir(root) as found:
            files = sorted(found, key=lambda file: (file.name.casefold(), file.name))
    except OSError:
        return
    for file in files:
        if file.name.startswith(".") or not file.name.lower().endswith(SUFFIX):
            continue
        with suppress(OSError):
            if file.is_symlink():
                target = Path(os.path.realpath(file.path))
                if target.is_relative_to(root) and target.suffix.lower() == SUFFIX and target.is_file():
                    yield file.name, str(target)
            elif file.is_file(follow_symlinks=False):
                yield file.name, file.path


def _labels(places: list[str]) -> list[str]:
    """Return for every path its last part, preceded by as many parts as make it unique."""
    parts = [[_printable(part) for part in Path(place).parts[1:]] or ["files"] for place in places]
    taken = [1] * len(parts)
    while True:
        labels = ["/".join(names[-count:]) for names, count in zip(parts, taken, strict=True)]
        counted = Counter(labels)
        longer = [n for n, label in enumerate(labels) if counted[label] > 1 and taken[n] < len(parts[n])]
        if not longer:
            return labels
        for n in longer:
            taken[n] += 1


def _printable(name: str) -> str:
    """Return a name fit for addresses and pages: no control characters, no bytes that are not UTF-8."""
    return "".join("�" if unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") else c for c in name)


def _add(places: dict[str, str], name: str, path: str) -> None:
    """Add a path under its name; under a numbered name if the name is taken."""
    free, number = name, 1
    while free in places:
        number += 1
        free = f"{name.removesuffix(SUFFIX)}-{number}{SUFFIX}"
    places[free] = path
