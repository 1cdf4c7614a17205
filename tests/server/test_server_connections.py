"""Clients that connect and ask for nothing, or never end to ask."""

import socket
import time
from contextlib import ExitStack

import pytest
from live_server import running

from upholster.server import connections

ASKED = b"GET /streams/quilt.uph HTTP/1.1\r\nHost: 127.0.0.1\r\n"


def line(client):
    return socket.create_connection(("127.0.0.1", client.port), timeout=30)


def ended(opened):
    """Whether the server has ended a connection, without waiting."""
    opened.settimeout(0)
    try:
        return opened.recv(1) == b""
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


def drip(opened, text):
    for byte in text:
        opened.sendall(bytes([byte]))
        time.sleep(0.05)


def test_idle_connections_keep_nobody_out(folder):
    with running(folder) as client, ExitStack() as kept:
        idle = [kept.enter_context(line(client)) for _ in range(520)]
        status, _, body = client.get("/streams/quilt.uph")
        assert status == 200
        assert body == (folder / "quilt.uph").read_bytes()
        # Those that have waited for a second go with the next that comes; the machine may be busy.
        for _ in range(30):
            left = sum(not ended(opened) for opened in idle)
            if left <= connections.MOST_IDLE:
                break
            time.sleep(0.3)
            assert client.get("/streams/quilt.uph")[0] == 200
        assert 0 < left <= connections.MOST_IDLE  # the newest stay


def test_a_head_that_does_not_come_is_not_waited_for(folder, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_SECONDS", 0.5)
    with running(folder) as client, line(client) as silent, line(client) as slow:
        silent.settimeout(10)
        assert silent.recv(1) == b""
        start = time.monotonic()
        with pytest.raises(ConnectionError):
            drip(slow, ASKED * 100)  # a byte now and then does not help
        assert time.monotonic() - start < 10


def test_a_long_answer_has_no_deadline(folder, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_SECONDS", 0.3)
    data = (folder / "quilt.uph").read_bytes()
    with running(folder, rate=int(8 * len(data) / 1.2)) as client:
        start = time.monotonic()
        assert client.get("/streams/quilt.uph")[2] == data
        assert time.monotonic() - start > 0.6


def test_a_connection_is_used_again_within_the_deadline(folder):
    with running(folder) as client, line(client) as opened:
        for _ in range(3):
            opened.sendall(ASKED.replace(b"GET", b"HEAD") + b"\r\n")
            assert opened.recv(1 << 16).startswith(b"HTTP/1.1 200")
