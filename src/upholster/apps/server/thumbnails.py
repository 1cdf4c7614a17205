"""Thumbnails of streams: drawn at the first request, in processes that can be ended, and remembered."""

import asyncio
import os

import anyio
from anyio import BrokenWorkerProcess, CapacityLimiter, to_process

from upholster.apps.server.guard import report
from upholster.apps.server.thumbnail_picture import draw_file, placeholder

__all__ = ["Thumbnails"]

_MOST_REMEMBERED = 256
_MOST_SECONDS = 10.0
"""Time limit of one picture. A normal one takes two; the first takes a few more, while the process starts."""

_FAILED_SECONDS = 60.0
"""Time after which a stream that failed is tried again: the machine may have been busy."""

_PROCESSES = 2
"""A slow stream occupies one of them; the other one draws the other streams' pictures."""


class Thumbnails:
    """Draws thumbnails, and remembers the last 256."""

    def __init__(self) -> None:
        self._tasks: dict[tuple[str, int, int], asyncio.Task[tuple[bytes, bool]]] = {}
        self._turns = CapacityLimiter(_PROCESSES)

    async def get(self, path: str, status: os.stat_result) -> tuple[bytes, bool]:
        """Return a PNG file's bytes, and whether it shows the stream.

        Without a preview, because drawing took too much time or memory, now or in the last minute, the
        picture says so.

        Parameters
        ----------
        path
            The stream's file.
        status
            The file's status: a different time or size means a different picture.
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
                shown = TimeoutError("takes too much time or memory") if ended else error
                report(f"picture of {os.path.basename(key[0])!r}", shown)
                asyncio.get_running_loop().call_later(_FAILED_SECONDS, self._tasks.pop, key, None)
                return placeholder("no preview", str(shown)), False


async def _picture(path: str) -> bytes:
    """Draw a stream's picture in a process of its own, which is ended if it takes too long."""
    with anyio.fail_after(_MOST_SECONDS):
        return await to_process.run_sync(draw_file, path, cancellable=True, limiter=CapacityLimiter(1))
