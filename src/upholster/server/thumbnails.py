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

from upholster.server.drawing import DRAWN, FAILED, FRAME, READ
from upholster.server.versions import Version

__all__ = ["DrawingError", "DrawingProcess", "Thumbnails"]

_MOST_REMEMBERED = 1 << 25
_MOST_SECONDS = 10.0
"""For one picture; an honest one takes two, the first one a few more, for the process starts."""

_FAILED_SECONDS = 60.0
"""After which a stream that failed is tried again: the machine may have been busy."""

_PROCESSES = 2
"""A stream that takes long holds up one of them; the others' pictures are drawn by the other."""


class DrawingError(Exception):
    """A picture could not be drawn: the message says why, `is_known` whether that has been told before."""

    def __init__(self, reason: str, *, is_known: bool = False) -> None:
        super().__init__(reason)
        self.is_known = is_known


class Thumbnails:
    """Makes thumbnails, and remembers 32 MiB of them."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, bytes] = OrderedDict()
        self._failed: dict[str, tuple[float, str]] = {}
        self._size = 0
        self._turns: weakref.WeakValueDictionary[str, asyncio.Lock] = weakref.WeakValueDictionary()
        self._idle: asyncio.LifoQueue[DrawingProcess] = asyncio.LifoQueue()
        for _ in range(_PROCESSES):
            self._idle.put_nowait(DrawingProcess())

    async def get(self, version: Version, *, gone: Callable[[], Awaitable[bool]]) -> bytes | None:
        """Return a PNG file's bytes; None if the client has gone before its turn.

        Parameters
        ----------
        version
            The stream.
        gone
            Tells whether no client waits for the answer any more.

        Raises
        ------
        DrawingError
            If the picture took too much time or memory, now or in the last minute.
        """
        turn = self._turns.setdefault(version.tag, asyncio.Lock())
        if (known := self._remembered(version.tag)) is not None:
            return known
        async with turn:
            process = await self._idle.get()
            try:
                if (known := self._remembered(version.tag)) is not None:
                    return known
                if await gone():
                    return None
                picture = await anyio.to_thread.run_sync(partial(process.draw, version))
            except DrawingError as error:
                self._failed.setdefault(version.tag, (time.monotonic(), str(error)))
                raise
            finally:
                self._idle.put_nowait(process)
            if version.unchanged():
                self._remember(version.tag, picture)
            return picture

    def _remembered(self, tag: str) -> bytes | None:
        now = time.monotonic()
        self._failed = {one: told for one, told in self._failed.items() if now - told[0] <= _FAILED_SECONDS}
        if tag in self._failed:
            raise DrawingError(self._failed[tag][1], is_known=True)
        if tag not in self._known:
            return None
        self._known.move_to_end(tag)
        return self._known[tag]

    def _remember(self, tag: str, picture: bytes) -> None:
        self._size += len(picture) - len(self._known.get(tag, b""))
        self._known[tag] = picture
        while self._size > _MOST_REMEMBERED and len(self._known) > 1:
            _, dropped = self._known.popitem(last=False)
            self._size -= len(dropped)


class DrawingProcess:
    """The process that draws, see `upholster.server.drawing`; started when needed, and ended with this."""

    def __init__(self) -> None:
        self._running: subprocess.Popen[bytes] | None = None
        self._end: Callable[[], object] = lambda: None

    def draw(self, version: Version) -> bytes:
        """Return a picture of a stream. One call at a time.

        Raises
        ------
        DrawingError
            If the process took too long, ended, or says that it can not.
        """
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
            return _conversation(version, process.stdin, process.stdout)
        except OSError as error:  # it has ended
            self._end()
            raise DrawingError("takes too much time or memory") from error
        finally:
            late.cancel()


def _conversation(version: Version, to: IO[bytes], back: IO[bytes]) -> bytes:
    """Name a stream to the process, give it what it asks for, and return the picture.

    Raises
    ------
    OSError
        If the process has ended.
    DrawingError
        If it says that it can not.
    """
    place = 0
    to.write(FRAME.pack(DRAWN, 0))
    to.flush()
    while len(head := back.read(FRAME.size)) == FRAME.size:
        kind, count = FRAME.unpack(head)
        if kind != READ:
            answer = back.read(count)
            if len(answer) < count:
                break
            if kind == FAILED:
                raise DrawingError(answer.decode())
            return answer
        piece = version.read(place, count)
        place += len(piece)
        to.write(FRAME.pack(READ, len(piece)) + piece)
        to.flush()
    raise BrokenPipeError("the process has ended")


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
