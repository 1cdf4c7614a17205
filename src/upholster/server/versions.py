"""Which version of a file is sent: its entity tag, and that no other version's bytes get among it."""

import hashlib
import os
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from io import FileIO

__all__ = ["Version", "Versions"]

_REMEMBERED = 4096
_ATTEMPTS = 4
_SETTLED_SECONDS = 2.0


@dataclass(frozen=True, slots=True)
class Version:
    """An open file at one moment.

    Attributes
    ----------
    file
        The file, unbuffered; the owner of the version closes it.
    tag
        Strong entity tag, quoted: a hash of the content, so that it is the same after a restart and on every
        machine, and another one whenever a byte differs.
    size
        Bytes.
    modified
        Seconds since 1970, whole, not in the future.
    """

    file: FileIO
    tag: str
    size: int
    modified: int
    _state: tuple[int, int]
    _inode: list[int] = field(default_factory=list)

    def read(self, start: int, count: int) -> bytes:
        """Return up to `count` bytes from `start` on: none if the file has been written to since."""
        self.file.seek(start)
        piece = self.file.read(count)
        # Looked at after reading: had the bytes been others, the file would show it now. A file that was
        # replaced, not written over, stays as it was for those who have it open.
        return piece if self.unchanged() else b""

    def unchanged(self) -> bool:
        """Whether the open file has not been written to since.

        A file may be written to and given its old time again. The time of the last change to its inode shows
        that, but also that it was renamed or replaced: then the content decides.
        """
        status = os.fstat(self.file.fileno())
        if _state(status) != self._state:
            return False
        if status.st_ctime_ns not in self._inode:
            if _tag(self.file) != self.tag or _state(os.fstat(self.file.fileno())) != self._state:
                return False
            self._inode[:] = [status.st_ctime_ns]
        return True


class Versions:
    """Finds the versions of files; hashes are remembered for as long as a file looks untouched."""

    def __init__(self) -> None:
        self._known: OrderedDict[tuple[int, ...], str] = OrderedDict()
        self._lock = threading.Lock()

    def identify(self, file: FileIO) -> Version | None:
        """Return the version that an open file has, or None if it is being written all the time.

        Reads the whole file where it has not been seen before; for threads, which may share one `Versions`.
        """
        for _ in range(_ATTEMPTS):
            before = os.fstat(file.fileno())
            key = (before.st_dev, before.st_ino, before.st_size, before.st_mtime_ns, before.st_ctime_ns)
            with self._lock:
                tag = self._known.get(key)
                if tag is not None:
                    self._known.move_to_end(key)
            if tag is None:
                tag = _tag(file)
                after = os.fstat(file.fileno())
                if (_state(after), after.st_ctime_ns) != (_state(before), before.st_ctime_ns):
                    continue
                self._remember(key, tag, before.st_ctime)
            modified = int(min(before.st_mtime, time.time()))
            return Version(file, tag, before.st_size, modified, _state(before), [before.st_ctime_ns])
        return None

    def _remember(self, key: tuple[int, ...], tag: str, changed: float) -> None:
        # A file's clock ticks every few milliseconds: one that was written just now may be written again and
        # look the same. Its inode's time counts, which nobody can set; where it lies ahead, the clock was
        # set back since.
        if 0 <= time.time() - changed < _SETTLED_SECONDS:
            return
        with self._lock:
            self._known[key] = tag
            while len(self._known) > _REMEMBERED:
                self._known.popitem(last=False)


def _tag(file: FileIO) -> str:
    """Return the entity tag of a file's content."""
    file.seek(0)
    return f'"{hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()}"'


def _state(status: os.stat_result) -> tuple[int, int]:
    # Without the time of the last change to the inode: replacing a file touches the old one's.
    return status.st_size, status.st_mtime_ns
