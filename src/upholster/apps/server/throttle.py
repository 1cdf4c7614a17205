"""Sending no faster than a line of a given rate."""

import time

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["Pace", "Throttle"]

_PIECES_PER_SECOND = 50
_MIN_PIECE, _MAX_PIECE = 64, 1 << 16
_PATIENCE = 0.1


class Pace:
    """The pace of one line, which carries all answers at the same time, piece by piece in turn.

    A piece is released when a real line would have carried its last byte. The schedule is absolute: a sleep
    that is a little too long is made up for, but time lost to a slow client or a stall beyond 0.1 s is lost.

    Parameters
    ----------
    rate
        Bits per second.

    Attributes
    ----------
    piece
        How many bytes to send at a time.
    """

    def __init__(self, rate: int) -> None:
        self.piece = min(_MAX_PIECE, max(_MIN_PIECE, rate // (8 * _PIECES_PER_SECOND)))
        self._seconds = 8 / rate  # per byte
        self._due = time.monotonic()

    async def wait(self, count: int) -> None:
        """Wait until the next `count` bytes have their turn."""
        self._due = max(self._due, time.monotonic() - _PATIENCE) + count * self._seconds
        await anyio.sleep(max(0.0, self._due - time.monotonic()))


class Throttle:
    """ASGI middleware: sends all of an application's answers over one slow line, including heads.

    Parameters
    ----------
    app
        The application that answers.
    pace
        The pace of that line.
    """

    def __init__(self, app: ASGIApp, pace: Pace) -> None:
        self._app = app
        self._pace = pace

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""

        async def paced(message: Message) -> None:
            if message["type"] == "http.response.start":
                await self._pace.wait(sum(len(name) + len(value) + 4 for name, value in message["headers"]))
            body, more = message.get("body", b""), message.get("more_body", False)
            while len(body) > self._pace.piece:
                piece, body = body[: self._pace.piece], body[self._pace.piece :]
                await self._pace.wait(len(piece))
                await send({"type": "http.response.body", "body": piece, "more_body": True})
            if body:
                await self._pace.wait(len(body))
                message = {**message, "body": body, "more_body": more}
            await send(message)

        await self._app(scope, receive, paced)
