"""Many clients at once, slow ones, ones that go away, bad ones: memory stays flat, nothing is left open."""

import http.client
import os
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from live_server import PATIENCE, wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

CLIENTS, EACH = 20, 10
SIZE = 16 << 20
MOST_GROWTH = 24 << 20  # of 320 MiB, were whole files kept for each client


def memory(process):
    return 1024 * int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text())[1])


def open_files(process):
    return len(os.listdir(f"/proc/{process.pid}/fd"))


@pytest.fixture
def server(folder):
    (folder / "big.uph").write_bytes(os.urandom(SIZE))
    os.utime(folder / "big.uph", (10**9, 10**9))
    command = [sys.executable, "-m", "upholster", "serve", str(folder), "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        process.port = int(re.search(r":(\d+)/", process.stdout.readline())[1])
        yield process
    finally:
        process.kill()
        process.communicate()


class Load:
    """One client: ten requests, by turns whole, in parts, slow, dropped, and nonsense."""

    def __init__(self, number, port, data):
        self.random, self.port, self.data = random.Random(number), port, data
        self.failure = None

    def run(self):
        try:
            for n in range(EACH):
                turn = (self.whole, self.part, self.nonsense, self.dropped, self.slow)[n % 5]
                turn()
        except Exception as error:
            self.failure = f"{turn.__name__}: {error!r}"

    def whole(self):
        status, body = self.get("/streams/quilt.uph")
        assert status == 200
        assert len(body) == self.data["quilt"]

    def part(self):
        start = self.random.randrange(SIZE - 1000)
        status, body = self.get("/streams/big.uph", f"bytes={start}-{start + 999}")
        assert status == 206
        assert body == self.data["big"][start : start + 1000]

    def nonsense(self):
        for value, status in ((f"bytes={SIZE}-", 416), ("bytes=9-1,", 400), ("\xff" * 500, 400)):
            assert self.get("/streams/smallest.uph", value)[0] == status
        assert self.get("/streams/" + "../" * 100 + "etc/passwd")[0] == 404

    def dropped(self):
        line = self.ask()
        line.recv(self.random.randrange(1, 5000))
        if self.random.random() < 0.5:  # reset instead of a farewell
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        line.close()

    def slow(self):
        with self.ask() as line:
            for _ in range(5):
                time.sleep(0.1)
                assert line.recv(4096)

    def ask(self):
        line = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)
        line.sendall(b"GET /streams/big.uph HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        return line

    def get(self, path, wanted=None):
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            line.request("GET", path, headers={} if wanted is None else {"Range": wanted})
            answer = line.getresponse()
            return answer.status, answer.read()
        finally:
            line.close()


@pytest.mark.slow(reason="starts processes")
def test_two_hundred_requests_of_twenty_clients(server, folder):
    data = {"big": (folder / "big.uph").read_bytes(), "quilt": (folder / "quilt.uph").stat().st_size}
    first = Load(0, server.port, data)
    first.run()  # threads are started, code is loaded
    assert first.failure is None
    memory_before, files_before = memory(server), open_files(server)
    most = [memory_before]
    over = threading.Event()

    def watch():
        while not over.wait(0.02):
            most.append(memory(server))

    clients = [Load(n, server.port, data) for n in range(CLIENTS)]
    threads = [threading.Thread(target=client.run) for client in clients]
    watching = threading.Thread(target=watch)
    watching.start()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(5 * PATIENCE)
    over.set()
    watching.join()
    assert not any(thread.is_alive() for thread in threads)
    assert [client.failure for client in clients] == [None] * CLIENTS
    assert max(most) - memory_before < MOST_GROWTH
    wait_until(lambda: open_files(server) <= files_before)
    server.send_signal(signal.SIGINT)
    output, errors = server.communicate(timeout=PATIENCE)
    assert (server.returncode, output) == (0, "")
    # Where the cache is empty, kernels are compiled, and the user reads so.
    assert [line for line in errors.splitlines() if not line.startswith("compiling ")] == []
