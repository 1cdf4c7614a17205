"""Clients that connect and ask for nothing, or never end to ask."""

import http.client
import socket
import time
from contextlib import ExitStack

import pytest
from live_server import PATIENCE, Turns, running, wait_until

from upholster.apps.server import connections

ASKED = b"GET /streams/quilt.uph HTTP/1.1\r\nHost: 127.0.0.1\r\n"


def line(client):
    return socket.create_connection(("127.0.0.1", client.port), timeout=PATIENCE)


def drip(opened, text):
    for byte in text:
        opened.sendall(bytes([byte]))
        time.sleep(0.05)


def test_idle_connections_keep_nobody_out(folder):
    with running(folder) as client, ExitStack() as kept:
        for _ in range(520):
            kept.enter_context(line(client))
        status, _, body = client.get("/streams/quilt.uph")
        assert status == 200
        assert body == (folder / "quilt.uph").read_bytes()


def test_a_head_that_does_not_come_is_not_waited_for(folder, monkeypatch):
    monkeypatch.setattr(connections, "HEAD_SECONDS", 0.5)
    with running(folder) as client:
        with line(client) as silent:
            assert silent.recv(1) == b""
        # A byte now and then does not help: without a deadline, this goes on for four minutes.
        with line(client) as slow, pytest.raises(ConnectionError):
            drip(slow, ASKED * 100)


def test_a_long_answer_has_no_deadline(folder, monkeypatch):
    made = []
    begin = connections.Connection.connection_made

    def begun(connection, *given):
        made.append(connection)
        begin(connection, *given)

    monkeypatch.setattr(connections.Connection, "connection_made", begun)
    turns = Turns(monkeypatch)
    data = (folder / "quilt.uph").read_bytes()
    with running(folder, rate=turns.RATE) as client:
        asking = http.client.HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE)
        asking.request("GET", "/streams/quilt.uph")
        turns.release()
        answer = asking.getresponse()
        came = answer.read(640)
        assert [one._deadline for one in made] == [None]
        turns.release(len(data))
        assert came + answer.read() == data
        # It has one again for the next request.
        wait_until(lambda: made[0]._deadline is not None)
        asking.close()


def test_a_connection_is_used_again_within_the_deadline(folder):
    with running(folder) as client, line(client) as opened:
        for _ in range(3):
            opened.sendall(ASKED.replace(b"GET", b"HEAD") + b"\r\n")
            assert opened.recv(1 << 16).startswith(b"HTTP/1.1 200")
