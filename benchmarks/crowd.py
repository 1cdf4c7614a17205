"""A crowd at ``upholster serve``: clients that never ask or never read, and others that download.

``python -m benchmarks crowd``: every download has to complete, and another client to be answered meanwhile.
"""

import http.client
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from benchmarks.measure import Results

__all__ = ["crowd"]

IDLE, DOWNLOADS = 500, 200
SIZE = 4 << 20
_REQUEST = b"GET /streams/big.uph HTTP/1.1\r\nHost: x\r\n\r\n"
_VECTORS = Path(__file__).parents[1] / "tests" / "vectors"


def crowd(results: Results) -> None:
    """Tell how many downloads were whole, and how long another client waited for an answer."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "big.uph").write_bytes(os.urandom(SIZE))
        (folder / "quilt.uph").write_bytes((_VECTORS / "quilt.uph").read_bytes())
        command = [sys.executable, "-m", "upholster", "serve", name, "--port", "0"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            assert server.stdout is not None
            found = re.search(r":(\d+)/", server.stdout.readline())
            assert found is not None
            whole, waits = _crowded(int(found[1]))
        finally:
            server.kill()
            server.wait()
    beside = f"beside {IDLE} clients that never ask or never read"
    results.add(f"downloads of {SIZE >> 20} MB {beside}: whole", whole, "", aim=str(DOWNLOADS))
    results.add("meanwhile another client's answer, median", waits[len(waits) // 2], "s")
    results.add("the longest of them", waits[-1], "s", aim="1")


def _crowded(port: int) -> tuple[int, list[float]]:
    lines = []
    for n in range(IDLE):
        line = socket.create_connection(("127.0.0.1", port))
        if n % 2:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            line.sendall(_REQUEST)  # and never reads
        lines.append(line)
    whole: list[int] = []
    clients = [threading.Thread(target=_download, args=(port, whole)) for _ in range(DOWNLOADS)]
    for client in clients:
        client.start()
    waits = []
    while any(client.is_alive() for client in clients):
        start = time.perf_counter()
        _get(port, "/streams/quilt.uph")
        waits.append(time.perf_counter() - start)
        time.sleep(0.05)
    for line in lines:
        line.close()
    return sum(whole), sorted(waits)


def _download(port: int, whole: list[int]) -> None:
    try:
        whole.append(len(_get(port, "/streams/big.uph")) == SIZE)
    except (OSError, http.client.HTTPException) as error:
        print(f"download: {error!r}", file=sys.stderr)


def _get(port: int, path: str) -> bytes:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=300)
    connection.request("GET", path)
    try:
        return connection.getresponse().read()
    finally:
        connection.close()
