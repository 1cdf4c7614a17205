"""Thumbnails of streams: drawn when first asked for, in processes that can be ended, and remembered."""

import asyncio
import os

import anyio
from anyio import BrokenWorkerProcess, CapacityLimiter, to_process

from upholster.server.guard import report
from upholster.server.thumbnail_drawing import draw_file, placeholder

__all__ = ["Thumbnails"]

_MOST_REMEMBERED = 256
_MOST_SECONDS = 10.0
"""For one picture; an honest one takes two, the first one a few more, for the process starts."""

_FAILED_SECONDS = 60.0
"""After which a stream that failed is tried again: the machine may have been busy."""

_PROCESSES = 2
"""A stream that takes long holds up one of them; the others' pictures are drawn by the other."""


class Thumbnails:
    """Draws thumbnails, and remembers the last 256."""

    def __init__(self) -> None:
        self._tasks: dict[tuple[str, int, int], asyncio.Task[tuple[bytes, bool]]] = {}
        self._turns = CapacityLimiter(_PROCESSES)

    async def get(self, path: str, status: os.stat_result) -> tuple[bytes, bool]:
        """Return a PNG file's bytes, and whether it shows the stream.

        It does not if drawing took too much time or memory, now or in the last minute; then it says so.

        Parameters
        ----------
        path
            The stream's file.
        status
            Of the file: another time or size means another picture.
        """
        key = (path, status.st_mtime_ns, status.st_size)
        if key not in self._tasks:
            self._tasks[key] = asyncio.create_task(self._draw(key))
            while len(self._tasks) > _MOST_REMEMBERED:
                del self._tasks[next(iter(self._tasks))]
        return await asyncio.shield(self._tasks[key])

    async def _draw(self, key: tuple[str, int, int]) -> tuple[bytes, bool]:
        async with self._turns:
            try:
                return await _picture(key[0]), True
            except Exception as error:
                ended = isinstance(error, TimeoutError | BrokenWorkerProcess)
                told = TimeoutError("takes too much time or memory") if ended else error
                report(f"picture of {os.path.basename(key[0])!r}", told)
                asyncio.get_running_loop().call_later(_FAILED_SECONDS, self._tasks.pop, key, None)
                return placeholder("no preview", str(told)), False


async def _picture(path: str) -> bytes:
    """Draw a stream's picture in a process of its own, which ends where it takes too long."""
    with anyio.fail_after(_MOST_SECONDS):
        return await to_process.run_sync(draw_file, path, cancellable=True, limiter=CapacityLimiter(1))
