"""Who a cached file belongs to: its content is code or a pickle, and either may run anything."""

import os
from pathlib import Path

__all__ = ["belongs"]


def belongs(path: Path, *others: int) -> bool:
    """Return whether a file or folder belongs to this user, or to one of some others, by their numbers.

    True where files have no owners; an `OSError` if there is no such file.
    """
    return os.name != "posix" or path.stat().st_uid in (os.getuid(), *others)
