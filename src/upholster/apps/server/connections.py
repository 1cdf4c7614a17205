"""A uvicorn connection with deadlines for its client."""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

__all__ = ["Connection"]

HEAD_SECONDS = 10.0
"""From the connection, or the end of the previous answer, to the end of a request's head."""

STALLED_SECONDS = 120.0
"""How long a client may leave its answer unread."""


class Connection(H11Protocol):
    """HTTP/1.1 by h11, which refuses heads of more than 16 KiB.

    A client that sends no request, sends a head byte by byte, or does not read its answer, occupies a
    connection that others need: uvicorn has no deadline for such clients.
    """

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for a request."""
        super().connection_made(transport)
        self._wait(HEAD_SECONDS)

    def data_received(self, data: bytes) -> None:
        """Receive data from the client."""
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete and not self.flow.write_paused:
            self._wait(None)

    def on_response_complete(self) -> None:
        """Wait for the next request, unless it is here already."""
        super().on_response_complete()
        if self.cycle is None or self.cycle.response_complete:
            self._wait(HEAD_SECONDS)

    def pause_writing(self) -> None:
        """Wait for the client to read."""
        super().pause_writing()
        self._wait(STALLED_SECONDS)

    def resume_writing(self) -> None:
        """Continue: the client has read."""
        super().resume_writing()
        self._wait(None)

    def connection_lost(self, exc: Exception | None) -> None:
        """Drop the connection's deadline."""
        self._wait(None)
        super().connection_lost(exc)

    def _wait(self, seconds: float | None) -> None:
        """Replace the current deadline; None for no deadline."""
        if self._deadline is not None:
            self._deadline.cancel()
        # Closing would wait for the data that the client does not read.
        end = self.transport.abort
        self._deadline = None if seconds is None else self.loop.call_later(seconds, end)
