"""Results that are kept on disk between runs, under the user's cache folder: models read and laid out flat.

A file's name is a digest of all that the result depends on: what was asked for, the program's sources and
what the first file holds. It holds what further files held, and the result; it begins with a checksum. One
that is damaged, or that cannot be written or read, counts as missing.
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

__all__ = ["cache_folder", "kept_on_disk"]

Value = TypeVar("Value")

FOLDER = "UPHOLSTER_CACHE"
"""The variable of the environment that names the folder; `off` keeps nothing."""

MOST_BYTES = 2**30
"""Of all files in the folder: those that were used longest ago are deleted beyond that."""

_ROOT = Path(__file__).parent


def cache_folder() -> Path | None:
    """Return where results are kept; None where they are not."""
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
    """Return what `make` returns, or returned in a run before for the same files.

    Parameters
    ----------
    asked
        What it depends on beside files; the same text for the same.
    make
        Makes it. The result must be one that can be pickled.
    file
        The file that is read first, if any.
    files
        All files that a result was made of.
    """
    folder = cache_folder()
    content = None if file is None else _digest(file)
    if folder is None or (file is not None and content is None):
        return make()
    name = repr((tuple(asked), file and os.path.realpath(file), content, _program()))
    place = folder / f"{hashlib.blake2b(name.encode(), digest_size=16).hexdigest()}.result"
    found = _read(place)
    if found is not None and all(_digest(name) == digest for name, digest in found[0].items()):
        value: Value = found[1]
        return value
    made = make()
    _write(place, ({name: _digest(name) for name in files(made)}, made))
    return made


def _read(place: Path) -> Any:
    with suppress(Exception):  # whatever is wrong with it, it is made anew
        data = place.read_bytes()
        if zlib.crc32(data[4:]) == int.from_bytes(data[:4], "little"):
            os.utime(place)
            return pickle.loads(data[4:])
    return None


def _write(place: Path, result: object) -> None:
    with suppress(OSError, pickle.PicklingError, TypeError):
        data = pickle.dumps(result, pickle.HIGHEST_PROTOCOL)
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        beside = place.with_suffix(f".{secrets.token_hex(4)}")
        beside.write_bytes(zlib.crc32(data).to_bytes(4, "little") + data)
        os.replace(beside, place)
        _tidy(place.parent)


def _tidy(folder: Path) -> None:
    """Delete the files that were used longest ago while all have more than `MOST_BYTES`."""
    told = [(entry.stat(), entry) for entry in folder.iterdir()]
    size = sum(state.st_size for state, _ in told)
    for state, entry in sorted(told, key=lambda one: one[0].st_mtime):
        if size <= MOST_BYTES:
            return
        with suppress(OSError):
            entry.unlink()
            size -= state.st_size


def _digest(file: str) -> str | None:
    """Return what stands for a file's content; None if it cannot be read."""
    try:
        with open(file, "rb") as opened:
            return hashlib.file_digest(opened, "blake2b").hexdigest()
    except OSError:
        return None


@cache
def _program() -> str:
    """Return what stands for the program: its version, and when its sources were written."""
    sources = sorted(_ROOT.rglob("*.py"))
    states = [(str(source), source.stat().st_size, source.stat().st_mtime_ns) for source in sources]
    return f"{__version__} {hashlib.blake2b(repr(states).encode()).hexdigest()}"
