"""The server's side of the worker process: requests that wait for an answer, and results of revisions."""

import asyncio
import itertools
import multiprocessing
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

from upholster.apps.studio.worker_process import serve_pipe
from upholster.base.errors import InputError

__all__ = ["Revision", "Worker"]

_KEPT = 4
"""Number of revisions whose looks are kept."""


@dataclass
class Revision:
    """The results of one change.

    Attributes
    ----------
    looks
        For each look: (is it the last, seconds, streams).
    stage, stages
        (name, done, total) of the current stage, and the number of its changes.
    facts, error
        Facts about model and sample; the reason for a failure.
    ended
        Whether it is complete.
    """

    looks: list[tuple[bool, float, list[bytes]]] = field(default_factory=list)
    stage: tuple[str, int, int] = ("", 0, 0)
    stages: int = 0
    facts: dict[str, Any] | None = None
    error: str = ""
    ended: bool = False


class Worker:
    """A process that holds the project; if it has died, another one is started.

    Parameters
    ----------
    folder
        The session's folder.
    most_bytes
        Largest memory of the process.
    """

    def __init__(self, folder: str, most_bytes: int) -> None:
        self._folder, self._most_bytes = folder, most_bytes
        self._numbers = itertools.count(1)
        self._waiting: dict[int, asyncio.Future[Any]] = {}
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._sending = threading.Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._heard = 0.0
        self.changed = asyncio.Event()
        self.revision = 0
        self.revisions: dict[int, Revision] = {}

    async def ask(self, name: str, *arguments: Any) -> Any:
        """Send a request; return the answer.

        Raises
        ------
        InputError
            With the worker's message; or if it died.
        """
        pipe = self._running()
        if not self._waiting:
            self._heard = time.monotonic()
        number = next(self._numbers)
        answer = self._waiting[number] = asyncio.get_running_loop().create_future()
        try:
            await asyncio.to_thread(self._send, pipe, (number, name, arguments))
            return await answer
        finally:
            self._waiting.pop(number, None)

    async def change(self, state: Any) -> dict[str, Any]:
        """Show another state; return the data that is known immediately."""
        self.revision += 1
        revision = self.revision
        self.revisions[revision] = Revision()
        for old in [one for one in self.revisions if one <= revision - _KEPT]:
            del self.revisions[old]
        self._wake()
        try:
            answer: dict[str, Any] = await self.ask("state", state, revision)
        except InputError as error:
            if revision in self.revisions:
                self.revisions[revision].error = str(error)
            raise
        return answer

    def end_if_silent(self, seconds: float) -> None:
        """End the process if it is busy and has sent nothing for this time; waiting callers get an error."""
        working = any(not (one.ended or one.error) for one in self.revisions.values()) or self._waiting
        if working and self._process is not None and time.monotonic() - self._heard > seconds:
            self._process.kill()

    def close(self) -> None:
        """End the process."""
        process, self._process, self._pipe = self._process, None, None
        if process is not None and process.is_alive():
            process.kill()
            process.join(5)

    def _running(self) -> Connection:
        if self._pipe is not None and self._process is not None and self._process.is_alive():
            return self._pipe
        self._loop = asyncio.get_running_loop()
        context = multiprocessing.get_context("spawn")
        own, theirs = context.Pipe()
        self._process = context.Process(
            target=serve_pipe, args=(theirs, self._folder, self._most_bytes), daemon=True, name="studio"
        )
        self._process.start()
        theirs.close()
        self._pipe = own
        threading.Thread(target=self._listen, args=(own, self._loop), daemon=True).start()
        return own

    def _send(self, pipe: Connection, message: Any) -> None:
        try:
            with self._sending:
                pipe.send(message)
        except (OSError, ValueError):
            raise InputError("the worker has ended; allowed: to try again") from None

    def _listen(self, pipe: Connection, loop: asyncio.AbstractEventLoop) -> None:
        """Pass the process's messages to the loop, until the process or the loop ends."""
        call: Callable[..., Any] = loop.call_soon_threadsafe
        with suppress(RuntimeError):  # the loop has ended
            with suppress(EOFError, OSError):
                while True:
                    call(self._take, pipe.recv())
            call(self._lost, pipe)

    def _take(self, message: tuple[Any, ...]) -> None:
        kind, number, *rest = message
        self._heard = time.monotonic()
        if kind in ("answer", "error"):
            waiting = self._waiting.get(number)
            if waiting is not None and not waiting.done():
                if kind == "answer":
                    waiting.set_result(rest[0])
                else:
                    waiting.set_exception(InputError(rest[0]))
            return
        revision = self.revisions.get(number)
        if revision is None:
            return
        if kind == "look":
            revision.looks.append((rest[0], rest[1], rest[2]))
        elif kind == "stage":
            revision.stage = (rest[0], rest[1], rest[2])
            revision.stages += 1
        elif kind == "facts":
            revision.facts = rest[0]
        elif kind == "failed":
            revision.error = rest[0]
        else:
            revision.ended = True
        self._wake()

    def _lost(self, pipe: Connection) -> None:
        """Report to all waiting callers that the process has ended; the next request starts another."""
        if pipe is not self._pipe:
            return
        self._pipe = None
        words = "the studio's worker ended: it needed too much memory or time; the next change starts another"
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(InputError(words))
        for revision in self.revisions.values():
            if not revision.ended:
                revision.error, revision.ended = words, True
        self._wake()

    def _wake(self) -> None:
        """Wake all callers that wait for changes."""
        self.changed.set()
        self.changed = asyncio.Event()
