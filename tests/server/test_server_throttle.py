"""Streams at the pace of a line; everything else as fast as it goes."""

import http.client
import os
import threading
import time

import anyio
import pytest
from live_server import running

from upholster.server.throttle import MAX_PIECE, Pace


@pytest.mark.parametrize(
    ("rate", "piece"), [(None, MAX_PIECE), (256_000, 640), (1000, 64), (10**11, MAX_PIECE)]
)
def test_pieces_are_small_where_the_line_is_slow(rate, piece):
    assert Pace(rate).piece == piece


def test_no_byte_comes_sooner_than_the_line_would_bring_it_and_the_rate_is_kept():
    async def run():
        pace = Pace(800_000)
        start = time.monotonic()
        late = []
        for count in range(2000, 40_001, 2000):
            await pace.wait(2000)
            late.append(time.monotonic() - start - count / 100_000)
        return late

    late = anyio.run(run)
    assert min(late) >= 0
    assert sorted(late)[len(late) // 2] < 0.1


def test_lost_time_is_not_made_up_for():
    async def run():
        pace = Pace(800_000)
        await anyio.sleep(0.5)
        start = time.monotonic()
        await pace.wait(20_000)
        return time.monotonic() - start

    assert 0.09 < anyio.run(run) < 1


def test_every_connection_has_the_rate_and_scripts_are_free(folder, monkeypatch):
    (folder / "big.uph").write_bytes(os.urandom(32_000))
    (folder / "big.js").write_bytes(bytes(128_000))
    monkeypatch.setattr("upholster.server.app._ASSETS", {"big.js": (folder, "text/javascript")})
    with running(folder, rate=512_000) as client:
        taken = []

        def fetch(**headers):
            start = time.perf_counter()
            status, _, body = client.get("/streams/big.uph", **headers)
            taken.append((status, len(body), time.perf_counter() - start))

        threads = [threading.Thread(target=fetch) for _ in range(3)]
        threads.append(threading.Thread(target=fetch, kwargs={"range": "bytes=16000-"}))
        for thread in threads:
            thread.start()
        start = time.perf_counter()
        assert len(client.get("/assets/big.js")[2]) == 128_000
        assert client.get("/streams/big.uph", "HEAD")[0] == 200
        assert time.perf_counter() - start < 1.5
        for thread in threads:
            thread.join()
    for status, count, seconds in taken:
        assert count == (16_000 if status == 206 else 32_000)
        assert 0.98 * count / 64_000 <= seconds < count / 64_000 + 1


def test_bytes_arrive_evenly(folder):
    (folder / "big.uph").write_bytes(os.urandom(16_000))
    with running(folder, rate=256_000) as client:
        line = http.client.HTTPConnection("127.0.0.1", client.port, timeout=30)
        start = time.perf_counter()
        line.request("GET", "/streams/big.uph")
        answer = line.getresponse()
        came = 0
        while part := answer.read1(1 << 16):
            came += len(part)
            assert came <= 32_000 * (time.perf_counter() - start) + 640
        assert came == 16_000
        line.close()
