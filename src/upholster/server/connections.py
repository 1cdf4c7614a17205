"""A connection of uvicorn's that does not wait for ever: deadlines for heads, and a limit of idle ones."""

import asyncio
from typing import Any, cast

from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["Connection"]

HEAD_SECONDS = 10.0
"""From the connection, or the end of the answer before, to the end of a request's head."""

MOST_IDLE = 64
"""Connections of one address that have had no request for a second; where there are more, those that wait
longest go. Of an honest client the head comes right behind."""

MOST_IDLE_IN_ALL = 512
"""The same for all addresses, however short they wait: half of what the server takes."""


class Connection(H11Protocol):
    """HTTP/1.1 by h11, which refuses heads of more than 16 KiB.

    Who connects and asks for nothing, or sends a head byte by byte, holds a place that others need: uvicorn
    has no deadline for them. Who asks and does not take the answer is for `upholster.server.sending`.
    """

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._deadline: asyncio.TimerHandle | None = None
        self._idle_since: float | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        self._wait()
        now, known = self.loop.time(), cast("set[Connection]", self.connections)
        idle = sorted(
            (other._idle_since, number, other)
            for number, other in enumerate(known)
            if other._idle_since is not None
        )
        here = [one for one in idle if one[2]._host() == self._host() and one[0] < now - 1]
        for _, _, other in {
            *here[: max(0, len(here) - MOST_IDLE)],
            *idle[: max(0, len(idle) - MOST_IDLE_IN_ALL)],
        }:
            other._end()

    def data_received(self, data: bytes) -> None:
        """Take what the client has sent."""
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop_waiting()

    def on_response_complete(self) -> None:
        """Wait for the next request, unless it is here already."""
        super().on_response_complete()
        if self.cycle is None or self.cycle.response_complete:
            self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _host(self) -> str | None:
        return self.client[0] if self.client else None

    def _wait(self) -> None:
        self._stop_waiting()
        self._idle_since = self.loop.time()
        self._deadline = self.loop.call_later(HEAD_SECONDS, self._end)

    def _stop_waiting(self) -> None:
        self._idle_since = None
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _end(self) -> None:
        self._stop_waiting()
        self.transport.abort()  # closing would wait for what the client does not take
