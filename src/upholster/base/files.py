"""Several output files written as one: all of them appear, or none does; and never over an input."""

import errno
import io
import os
import re
import secrets
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, cast

from upholster.base.errors import InputError

__all__ = ["Outputs", "outputs", "path_inside", "path_text", "read_bytes", "write_bytes", "writing"]

MAX_BYTES = 1 << 30

_TEMPORARY = re.compile(r"\.upholster-(\d+)-[0-9a-f]{8}(\.[^/]*)?")
"""Names of temporary files: the number of the process that writes, and random digits."""

_ABANDONED = 3600.0
"""Seconds without a change after which the temporary file of a dead process may be removed: on a shared disk
the process may run on another machine."""

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a file for which there is no room."""

_Identity = tuple[int, int]
"""Device and inode: equal for all names of one file."""


def path_text(path: object, what: str = "file") -> str:
    """Return a path as text.

    Parameters
    ----------
    path
        Text, a `pathlib.Path`, or another path-like object.
    what
        The value's name in messages.

    Raises
    ------
    InputError
        If it is none of these.
    """
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else path
    if not isinstance(name, str):
        raise InputError(f"{what} is a {type(path).__name__}; allowed: a path, as text or pathlib.Path")
    if name in ("", "-"):
        raise InputError(f"{what} is {name!r}; allowed: a file's name (standard input is not read)")
    return name


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return a file's contents.

    Raises
    ------
    InputError
        If it is missing, not a regular file, unreadable, or larger than 1 GiB.
    """
    name = path_text(path)
    try:
        if "\0" in name:
            raise InputError(f"file {name!r} contains a null character")
        if not os.path.exists(name):
            raise InputError(f"file {name!r} does not exist; allowed: a file that is there")
        if not os.path.isfile(name):
            raise InputError(f"{name!r} is not a regular file")
        if os.path.getsize(name) > MAX_BYTES:
            raise InputError(f"file {name!r} has {os.path.getsize(name):,} bytes; allowed: {MAX_BYTES:,}")
        return Path(name).read_bytes()
    except OSError as error:
        raise InputError(f"file {name!r} cannot be read: {error.strerror}") from None


def path_inside(folders: Sequence[str | os.PathLike[str]], name: str | os.PathLike[str]) -> Path:
    """Return the path of a file that is named in another file, with links followed.

    The naming file may come from an untrusted source: it must not reach files that the user has not given.

    Parameters
    ----------
    folders
        Folders in which the file may be, at any depth. A relative name starts in the first one.
    name
        The name as written in the file.

    Raises
    ------
    InputError
        If the path is outside all folders, or the name is not a file's name.
    """
    try:
        place = Path(os.path.realpath(Path(folders[0], name)))
    except (OSError, ValueError):
        raise InputError(f"it refers to {os.fspath(name)[:80]!r}; allowed: names of files") from None
    if not any(place.is_relative_to(os.path.realpath(folder)) for folder in folders):
        listed = " or ".join(repr(os.fspath(folder)) for folder in folders)
        raise InputError(f"it refers to {os.fspath(name)[:80]!r}; allowed: files in the folder {listed}")
    return place


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file to be written. If there is no room for it, the error gives the bytes that it takes.

    Raises
    ------
    InputError
        At the end of the body, if there is no room: so that all that it writes is counted.
    """
    file = _Counting(path)
    with io.BufferedWriter(file) as buffered:
        yield cast(BinaryIO, buffered)
    if file.error is not None:
        raise InputError(
            f"{os.fspath(path)!r} cannot be written: {file.error.strerror}; it takes {file.size:,} bytes"
        )


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file; errors as for `writing`."""
    with writing(path) as file:
        file.write(data)


class _Counting(io.RawIOBase):
    """A file that goes on without writing when there is no room: `size` is what it takes, `error` why."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = open(path, "wb", buffering=0)  # noqa: SIM115  # closed by `close`
        self._at = self.size = 0
        self.error: OSError | None = None

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def write(self, data: Any, /) -> int:
        view = memoryview(data).cast("B")
        left = view
        while len(left) and self.error is None:
            try:
                left = left[self._file.write(left) :]
            except OSError as error:
                if error.errno not in _FULL:
                    raise
                self.error = error
        self._at += len(view)
        self.size = max(self.size, self._at)
        return len(view)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + (0, self._at, self.size)[whence]
        if self.error is None:
            self._file.seek(self._at)
        return self._at

    def tell(self) -> int:
        return self._at

    def close(self) -> None:
        super().close()
        self._file.close()


class Outputs:
    """The files of one transaction, each with a temporary path until all are written. Made by `outputs`."""

    def __init__(self, inputs: Iterable[str | os.PathLike[str]] = ()) -> None:
        self._temporary: dict[Path, Path] = {}  # target -> temporary file
        self._inputs: dict[_Identity, str] = {}
        self._existing: dict[_Identity, str] = {}  # targets that exist already
        self.keep(inputs)

    def keep(self, inputs: Iterable[str | os.PathLike[str]]) -> None:
        """Declare files that are read; some of them may be known only inside the body.

        Raises
        ------
        InputError
            If one is a target that was declared before.
        """
        for file in inputs:
            if (identity := _identity(file)) is None:
                continue
            self._inputs.setdefault(identity, os.fspath(file))
            if identity in self._existing:
                raise InputError(
                    f"output {self._existing[identity]!r} is the same file as input {os.fspath(file)!r}; "
                    "allowed: any other file"
                )

    def add(self, targets: Iterable[str | os.PathLike[str]]) -> None:
        """Declare targets, some of which may have been declared before.

        Raises
        ------
        InputError
            As for `outputs`.
        """
        given = set[Path]()
        for target in targets:
            temporary = self.path(target)
            if temporary in given:
                raise InputError(f"output {os.fspath(target)!r} is given twice")
            given.add(temporary)

    def path(self, target: str | os.PathLike[str]) -> Path:
        """Return the temporary path at which to write `target`: same directory, same suffix.

        A target that was not declared is checked now, as `outputs` does.

        Raises
        ------
        InputError
            If `target` cannot be written, or is an input or another target.
        """
        name = os.fspath(target)
        if "\0" in name:
            raise InputError(f"output {name!r} contains a null character")
        # Symbolic links stay: the file that they point to is written.
        place = Path(os.path.realpath(name))
        if place not in self._temporary:
            temporary = place.with_name(f".upholster-{os.getpid()}-{secrets.token_hex(4)}{place.suffix}")
            self._check_apart(name, place)
            _check_writable(name, place, temporary)
            if all(place.parent != other.parent for other in self._temporary):
                _sweep(place.parent)
            self._temporary[place] = temporary
        return self._temporary[place]

    def _check_apart(self, name: str, place: Path) -> None:
        """Raise if `place` is the file of an input or of another target."""
        identity = _identity(place)
        if identity is None:
            return
        if identity in self._inputs:
            raise InputError(
                f"output {name!r} is the same file as input {self._inputs[identity]!r}; "
                "allowed: any other file"
            )
        if identity in self._existing:
            raise InputError(f"output {name!r} is the same file as output {self._existing[identity]!r}")
        self._existing[identity] = name

    def _commit(self) -> None:
        written = {place: temporary for place, temporary in self._temporary.items() if temporary.exists()}
        for temporary in written.values():
            _flush(temporary)
        for place, temporary in written.items():
            os.replace(temporary, place)

    def _discard(self) -> None:
        for temporary in self._temporary.values():
            with suppress(OSError):
                temporary.unlink()

    def _by_target(self, text: str) -> str:
        """Return a message with the targets' names in place of the temporary files'."""
        for place, temporary in self._temporary.items():
            text = text.replace(os.fspath(temporary), os.fspath(place))
        return text

    def _refusal(self, error: OSError) -> InputError | None:
        """Return the error to raise for an operating system's error, None if it is not about the outputs."""
        if error.filename is None:
            return InputError(f"outputs cannot be written: {error.strerror or error}")
        for place, temporary in self._temporary.items():
            if os.fspath(error.filename) == os.fspath(temporary):
                return InputError(f"output {os.fspath(place)!r} cannot be written: {error.strerror}")
        return None


@contextmanager
def outputs(
    targets: Iterable[str | os.PathLike[str]] = (), *, inputs: Iterable[str | os.PathLike[str]] = ()
) -> Iterator[Outputs]:
    """Write files as one transaction.

    Before the body runs, each target is checked to be writable. When the body ends, all temporary files are
    flushed to the disk, and only then renamed to their targets, one after the other. When it raises, Ctrl-C
    included, they are removed and the targets are as before. Each target is complete at all times: the old
    file or the new one. If a process is killed (``kill -9``, loss of power) while it renames, some targets
    may be new and some old. If it is killed earlier, all are old, and its temporary files stay until a later
    run that writes to the folder removes them.

    Parameters
    ----------
    targets
        The files to write; `Outputs.add` declares further ones. A target that the body has not written stays
        as it is.
    inputs
        The files that are read, none of which may be written. Missing ones are ignored: reading them will
        report the error.

    Yields
    ------
    Outputs
        ``files.path(target)`` is the temporary path at which to write `target`.

    Raises
    ------
    InputError
        If a target is a directory or not a regular file, its directory is missing or not writable, it is an
        input, or two targets are one file (symbolic links, hard links and other spellings count as the file
        that they lead to); if the operating system refuses later (disk full).
    """
    files = Outputs(inputs)
    files.add(targets)
    try:
        yield files
        files._commit()
    except OSError as error:
        refusal = files._refusal(error)
        if refusal is None:
            raise
        raise refusal from error
    except InputError as error:
        raise InputError(files._by_target(str(error))) from error
    finally:
        files._discard()


def _flush(file: Path) -> None:
    """Wait until a file's bytes are on the disk: a name must never lead to a file that is not there yet."""
    try:
        with file.open("rb+") as opened:
            os.fsync(opened.fileno())
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(file)) from None


def _sweep(folder: Path) -> None:
    """Remove temporary files that killed processes have left in a folder; ignore those that resist."""
    with suppress(OSError):
        for entry in os.scandir(folder):
            found = _TEMPORARY.fullmatch(entry.name)
            if found is None or _runs(int(found[1])):
                continue
            with suppress(OSError):
                if time.time() - entry.stat(follow_symlinks=False).st_mtime > _ABANDONED:
                    os.unlink(entry.path)


def _runs(process: int) -> bool:
    """Return whether a process of that number runs; True if the system can not say."""
    if os.name != "posix":
        return True  # on other systems os.kill would end it
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def _identity(path: str | os.PathLike[str]) -> _Identity | None:
    """Return an identity that all names of a file share; None if there is no such file."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):  # the latter for a null character
        return None
    return found.st_dev, found.st_ino


def _check_writable(name: str, place: Path, probe: Path) -> None:
    """Raise unless a file can be made at `place`. Permissions do not prove that: `probe` is made there."""
    try:
        if not place.parent.is_dir():
            raise InputError(f"output {name!r} cannot be written: its directory does not exist")
        if name.endswith(("/", os.sep)) or place.is_dir():
            raise InputError(f"output {name!r} is a directory; allowed: a file")
        if place.exists() and not place.is_file():
            raise InputError(f"output {name!r} is not a regular file; allowed: a new or a regular file")
        probe.open("xb").close()
        probe.unlink()
    except OSError as error:
        raise InputError(f"output {name!r} cannot be written: {error.strerror}") from None
