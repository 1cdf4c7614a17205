"""Results kept on disk between runs, in the user's cache folder: models read and laid out flat.

A file's name is a digest of everything that determines the result: the request, the program's sources, and
the contents of the first input file. The file holds digests of further input files, and the result; it begins
with a checksum. A file that is damaged, or that cannot be written or read, counts as missing.
"""

import hashlib
import os
import pickle
import secrets
import zlib
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

from upholster._version import __version__
from upholster.runtime.ownership import belongs

__all__ = ["cache_folder", "kept_on_disk"]

Value = TypeVar("Value")

FOLDER = "UPHOLSTER_CACHE"
"""The environment variable that names the folder; `off` turns the cache off."""

MOST_BYTES = 2**30
"""Largest size of all results in the folder: beyond it the least recently used are deleted."""

_SUFFIX = ".upholster-kept"

_ROOT = Path(__file__).parents[1]


def cache_folder() -> Path | None:
    """Return the folder of results; None if the cache is off."""
    named = os.environ.get(FOLDER, "")
    if named.lower() == "off":
        return None
    return Path(named) if named else Path(platformdirs.user_cache_dir("upholster", appauthor=False))


def kept_on_disk(
    asked: Iterable[object],
    make: Callable[[], Value],
    *,
    file: str | None = None,
    files: Callable[[Value], Iterable[str]] = lambda _: (),
) -> Value:
    """Return the result of `make`, or that of an earlier run for the same files.

    Parameters
    ----------
    asked
        A text that identifies the request, apart from files; equal requests have equal texts.
    make
        Computes the result, which must be one that can be pickled.
    file
        The first input file, if any.
    files
        Returns all input files of a result.
    """
    folder = cache_folder()
    content = None if file is None else _digest(file)
    if folder is None or (file is not None and content is None):
        return make()
    name = repr((tuple(asked), file and os.path.realpath(file), content, _program()))
    place = folder / f"{hashlib.blake2b(name.encode(), digest_size=16).hexdigest()}{_SUFFIX}"
    found = _read(place)
    if found is not None and all(_digest(name) == digest for name, digest in found[0].items()):
        value: Value = found[1]
        return value
    made = make()
    _write(place, ({name: _digest(name) for name in files(made)}, made))
    return made


def _read(place: Path) -> Any:
    with suppress(Exception):  # after any error, the result is computed again
        if not belongs(place):
            return None
        data = place.read_bytes()
        if zlib.crc32(data[4:]) == int.from_bytes(data[:4], "little"):
            os.utime(place)
            return pickle.loads(data[4:])
    return None


def _write(place: Path, result: object) -> None:
    with suppress(OSError, pickle.PicklingError, TypeError):
        data = pickle.dumps(result, pickle.HIGHEST_PROTOCOL)
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        temporary = place.with_suffix(f"{_SUFFIX}-{secrets.token_hex(4)}")
        temporary.write_bytes(zlib.crc32(data).to_bytes(4, "little") + data)
        os.replace(temporary, place)
        _tidy(place.parent)


def _tidy(folder: Path) -> None:
    """Delete the least recently used results until all together have at most `MOST_BYTES`."""
    results = [(entry.stat(), entry) for entry in folder.glob(f"*{_SUFFIX}*")]
    size = sum(state.st_size for state, _ in results)
    for state, entry in sorted(results, key=lambda one: one[0].st_mtime):
        if size <= MOST_BYTES:
            return
        with suppress(OSError):
            entry.unlink()
            size -= state.st_size


def _digest(file: str) -> str | None:
    """Return a digest of a file's content; None if it cannot be read."""
    try:
        with open(file, "rb") as opened:
            return hashlib.file_digest(opened, "blake2b").hexdigest()
    except OSError:
        return None


@cache
def _program() -> str:
    """Return a digest of the program: its version, and the times at which its sources were written."""
    sources = sorted(_ROOT.rglob("*.py"))
    states = [(str(source), source.stat().st_size, source.stat().st_mtime_ns) for source in sources]
    return f"{__version__} {hashlib.blake2b(repr(states).encode()).hexdigest()}"
