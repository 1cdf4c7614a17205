"""What a process has read last, for a next job that reads the same: on in the workers of a batch only."""

import os
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable
from typing import Any, TypeVar

__all__ = ["recalled", "remember"]

Value = TypeVar("Value")
_State = tuple[tuple[str, int, int], ...]

_limit = 0
_entries: "OrderedDict[Hashable, tuple[_State, tuple[str, ...], Any]]" = OrderedDict()


def remember(count: int) -> None:
    """Keep the last `count` things that were read in this process; 0 forgets all and keeps nothing."""
    global _limit
    _limit = count
    while len(_entries) > count:
        _entries.popitem(last=False)


def recalled(
    key: Hashable, read: Callable[[], Value], files: Callable[[Value], Iterable[str | os.PathLike[str]]]
) -> Value:
    """Return what `read` returns, or returned before for the same key, if no file has changed since.

    Parameters
    ----------
    key
        What is read, and how.
    read
        Reads it. What it returns is shared: nobody may change it.
    files
        The files that it was read from.
    """
    if not _limit:
        return read()
    known = _entries.get(key)
    if known is not None and known[0] == _state(known[1]):
        _entries.move_to_end(key)
        found: Value = known[2]
        return found
    value = read()
    names = tuple(os.fspath(file) for file in files(value))
    _entries[key] = _state(names), names, value
    _entries.move_to_end(key)
    remember(_limit)
    return value


def _state(files: Iterable[str]) -> _State:
    """Return size and time of files; of those that are missing, none."""
    found = []
    for name in files:
        try:
            told = os.stat(name)
        except OSError:
            found.append((name, -1, -1))
        else:
            found.append((name, told.st_size, told.st_mtime_ns))
    return tuple(found)
