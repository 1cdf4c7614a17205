"""Sending no faster than a line of a given rate would carry it."""

import time

import anyio

__all__ = ["MAX_PIECE", "Pace"]

MAX_PIECE = 1 << 16
_PIECES_PER_SECOND = 50
_MIN_PIECE = 64
_PATIENCE = 0.1


class Pace:
    """The pace of one response, and so of one connection, which carries one response at a time.

    A piece is let go when a real line would have carried its last byte. The schedule is absolute: sleeping a
    little too long is made up for, but what a slow client or a stall loses beyond 0.1 s is lost.

    Parameters
    ----------
    rate
        Bits per second; None: as fast as it goes.

    Attributes
    ----------
    piece
        How many bytes to send at a time.
    """

    def __init__(self, rate: int | None) -> None:
        self.piece = MAX_PIECE
        self._seconds = 0.0
        if rate is not None:
            self._seconds = 8 / rate  # per byte
            self.piece = min(MAX_PIECE, max(_MIN_PIECE, rate // (8 * _PIECES_PER_SECOND)))
        self._due = time.monotonic()

    async def wait(self, count: int) -> None:
        """Wait until the next `count` bytes have their turn."""
        if self._seconds:
            self._due = max(self._due, time.monotonic() - _PATIENCE) + count * self._seconds
            await anyio.sleep(max(0.0, self._due - time.monotonic()))
