"""Thumbnails of streams: made when first asked for, in a process that can be ended, and remembered."""

import asyncio
import os
import subprocess
import sys
import threading
import time
import weakref
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO

import anyio.to_thread

from upholster.server.drawing import DRAWN, FRAME, READ, placeholder
from upholster.server.versions import Version

__all__ = ["DrawingProcess", "Thumbnails"]

_MOST_REMEMBERED = 1 << 25
_MOST_SECONDS = 30.0
"""For one picture; an honest one takes two, the first one a few more, for the process starts."""

_FAILED_SECONDS = 600.0
"""After which a stream that took too long is tried again: the machine may have been busy."""


class Thumbnails:
    """Makes thumbnails, and remembers 32 MiB of them."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, bytes] = OrderedDict()
        self._failed: dict[str, float] = {}
        self._size = 0
        self._turn = asyncio.Lock()
        self._process = DrawingProcess()

    async def get(self, version: Version, *, gone: Callable[[], Awaitable[bool]]) -> bytes | None:
        """Return a PNG file's bytes; None if the client has gone before its turn.

        Parameters
        ----------
        version
            The stream.
        gone
            Tells whether no client waits for the answer any more.
        """
        if (known := self._remembered(version.tag)) is not None:
            return known
        async with self._turn:
            if (known := self._remembered(version.tag)) is not None:
                return known
            if await gone():
                return None
            picture = await anyio.to_thread.run_sync(partial(self._process.draw, version))
            if picture is None:
                self._failed[version.tag] = time.monotonic()
                picture = placeholder("no preview", "takes too much time or memory")
            if version.unchanged():
                self._remember(version.tag, picture)
            return picture

    def _remembered(self, tag: str) -> bytes | None:
        if time.monotonic() - self._failed.get(tag, time.monotonic()) > _FAILED_SECONDS:
            del self._failed[tag]
            self._size -= len(self._known.pop(tag, b""))
        if tag not in self._known:
            return None
        self._known.move_to_end(tag)
        return self._known[tag]

    def _remember(self, tag: str, picture: bytes) -> None:
        self._size += len(picture) - len(self._known.get(tag, b""))
        self._known[tag] = picture
        while self._size > _MOST_REMEMBERED and len(self._known) > 1:
            other, dropped = self._known.popitem(last=False)
            self._size -= len(dropped)
            self._failed.pop(other, None)


class DrawingProcess:
    """The process that draws, see `upholster.server.drawing`; started when needed, and ended with this."""

    def __init__(self) -> None:
        self._running: subprocess.Popen[bytes] | None = None
        self._end: Callable[[], object] = lambda: None

    def draw(self, version: Version) -> bytes | None:
        """Return a picture of a stream; None if the process took too long, or ended. One call at a time."""
        process = self._running
        if process is None or process.poll() is not None:
            self._end()
            process = self._running = _started()
            self._end = weakref.finalize(self, _ended, process)
        late = threading.Timer(_MOST_SECONDS, process.kill)
        late.start()
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            picture = _conversation(version, process.stdin, process.stdout)
        except OSError:  # it has ended
            picture = None
        finally:
            late.cancel()
        if picture is None:
            self._end()
        return picture


def _conversation(version: Version, to: IO[bytes], back: IO[bytes]) -> bytes | None:
    """Name a stream to the process, give it what it asks for, and return the picture."""
    place = 0
    to.write(FRAME.pack(DRAWN, 0))
    to.flush()
    while len(head := back.read(FRAME.size)) == FRAME.size:
        kind, count = FRAME.unpack(head)
        if kind == DRAWN:
            picture = back.read(count)
            return picture if len(picture) == count else None
        piece = version.read(place, count)
        place += len(piece)
        to.write(FRAME.pack(READ, len(piece)) + piece)
        to.flush()
    return None


def _ended(process: "subprocess.Popen[bytes]") -> None:
    """End the process, and close what leads to it."""
    process.kill()
    with suppress(OSError):
        process.communicate()


def _started() -> "subprocess.Popen[bytes]":
    # The package may lie anywhere on this process's path; the working directory is none of its business.
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])
    return subprocess.Popen(
        [sys.executable, "-P", "-c", "from upholster.server.drawing import work; work()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
    )
