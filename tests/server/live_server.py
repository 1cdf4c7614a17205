"""A server on loopback, in a thread of the test's own process."""

import http.client
import socket
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import anyio

from upholster.apps.server import Catalogue, make_app
from upholster.apps.server.http_server import serving
from upholster.apps.server.throttle import Pace

PATIENCE = 600
"""Seconds after which what has not come never will: the machine may be busy, and ten times slower."""

VECTORS = Path(__file__).parent.parent / "vectors"


class Client(SimpleNamespace):
    """What tests ask of a running server: `port`, and the answers below."""

    def get(self, path, method="GET", **headers):
        """Return status, headers (names in lower case) and body; the path goes out as it is."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            connection.putrequest(method, path, skip_host="host" in headers, skip_accept_encoding=True)
            for name, value in headers.items():
                connection.putheader(name.replace("_", "-"), value)
            connection.endheaders()
            answer = connection.getresponse()
            reported = {name.lower(): value for name, value in answer.getheaders()}
            return answer.status, reported, answer.read()
        finally:
            connection.close()

    def raw(self, text):
        """Send bytes as they are, and return all that comes back."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE) as line:
            line.sendall(text)
            parts = []
            while part := line.recv(1 << 16):
                parts.append(part)
        return b"".join(parts)


def wait_until(condition):
    """Wait for what another thread or process does by itself."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "what is waited for does not come"
        time.sleep(0.02)


class Turns:
    """Pieces of answers, each of which waits until the test lets it go; a piece is 640 bytes.

    Heads, and what is left of an answer at its end, do not wait.
    """

    RATE = 256_000

    def __init__(self, monkeypatch):
        self._free = threading.Semaphore(0)

        async def wait(_pace, count):
            while count == 640 and not self._free.acquire(blocking=False):
                await anyio.sleep(0.005)

        monkeypatch.setattr(Pace, "wait", wait)

    def release(self, count=1):
        self._free.release(count)


@contextmanager
def running(*paths, **options):
    """Serve files and folders; yields a client."""
    with serving(make_app(Catalogue([str(path) for path in paths]), **options)) as address:
        yield Client(port=int(address.rstrip("/").rpartition(":")[2]))
