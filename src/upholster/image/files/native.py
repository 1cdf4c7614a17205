"""Working around the C libraries below OpenImageIO: one prints errors, another ends the process."""

import os
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from upholster.base.errors import InputError

__all__ = ["scratch_file", "silent"]

_lock = threading.RLock()


@contextmanager
def silent() -> Iterator[None]:
    """Send file descriptor 2 to nowhere while the body runs.

    libpng prints errors of a broken file there, below Python's ``sys.stderr``; OpenImageIO returns the same
    words as its own error. One thread at a time: the descriptor belongs to the whole process.
    """
    with _lock:
        try:
            saved = os.dup(2)
        except OSError:  # closed, as in a service: there is nothing to silence
            yield
            return
        try:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 2)
            os.close(nowhere)
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)


@contextmanager
def scratch_file(size: int) -> Iterator[str]:
    """Yield the name of a file for OpenImageIO to write, where the disk is never full.

    libjpeg ends the process when it cannot write, and libpng reports nothing. So images are written here, and
    Python, whose errors can be caught, copies their bytes. The file is in memory where the system allows.

    Parameters
    ----------
    size
        Bytes that the image takes before compression.

    Raises
    ------
    InputError
        If the file has to be on a disk that has no room for it.
    """
    if hasattr(os, "memfd_create") and os.path.isdir("/proc/self/fd"):
        memory = os.memfd_create("upholster")
        try:
            yield f"/proc/self/fd/{memory}"
        finally:
            os.close(memory)
        return
    with tempfile.TemporaryDirectory(prefix="upholster-") as folder:
        needed = size + (size >> 3) + (1 << 20)
        if shutil.disk_usage(folder).free < needed:
            raise InputError(
                f"temporary directory {folder!r} has too little room; allowed: {needed} bytes free"
            )
        yield os.fspath(Path(folder, "image"))
