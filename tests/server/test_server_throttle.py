"""Everything goes over one line at its pace. The clock is the test's own."""

import gzip
import http.client
import os
import threading
from types import SimpleNamespace

import anyio
import pytest
from live_server import PATIENCE, Turns, running

from upholster.apps.server.throttle import Pace


@pytest.mark.parametrize(("rate", "piece"), [(256_000, 640), (1000, 64), (10**11, 65536)])
def test_pieces_are_small_where_the_line_is_slow(rate, piece):
    assert Pace(rate).piece == piece


class Clock:
    """Time that passes where somebody sleeps, each time `late` seconds longer than asked for."""

    def __init__(self, monkeypatch, late=0.0):
        self.now, self.late = 1000.0, late
        monkeypatch.setattr(
            "upholster.apps.server.throttle.time", SimpleNamespace(monotonic=lambda: self.now)
        )
        monkeypatch.setattr("upholster.apps.server.throttle.anyio", SimpleNamespace(sleep=self.sleep))

    async def sleep(self, seconds):
        assert seconds >= 0
        if seconds:
            self.now += seconds + self.late


def test_the_rate_of_the_line_is_kept(monkeypatch):
    clock = Clock(monkeypatch, late=0.004)

    async def run():
        start, pace, late = clock.now, Pace(800_000), []
        for count in range(2000, 40_001, 2000):
            await pace.wait(2000)
            late.append(clock.now - start - count / 100_000)
        return late

    late = anyio.run(run)
    assert min(late) > -1e-9
    # Sleeping too long is made up for: it does not add up.
    assert max(late) < 0.004 + 1e-9


def test_lost_time_is_not_made_up_for(monkeypatch):
    clock = Clock(monkeypatch)

    async def run():
        pace = Pace(800_000)
        clock.now += 0.5
        start = clock.now
        await pace.wait(20_000)
        return clock.now - start

    assert anyio.run(run) == pytest.approx(20_000 / 100_000 - 0.1)


@pytest.fixture
def paces(monkeypatch):
    """Every pace that the server keeps: its rate, and the pieces that waited for it. Nobody really waits."""
    kept = []

    class Counted(Pace):
        def __init__(self, rate):
            super().__init__(rate)
            self.rate, self.counts = rate, []
            kept.append(self)

        async def wait(self, count):
            self.counts.append(count)

    monkeypatch.setattr("upholster.apps.server.app.Pace", Counted)
    return kept


def test_one_line_carries_streams_scripts_pages_and_heads(folder, paces):
    (folder / "big.uph").write_bytes(os.urandom(32_000))
    with running(folder, rate=512_000) as client:
        (pace,) = paces
        assert pace.rate == 512_000

        def sent(path, method="GET", **headers):
            pace.counts.clear()
            _, reported, body = client.get(path, method, **headers)
            assert max(pace.counts) <= 1280
            return sum(pace.counts) - len(body), reported

        for path in ("/assets/uph-worker.js", "/streams/big.uph", "/"):
            head, reported = sent(path)
            # The date and the line of the status come from the server beneath.
            assert head >= sum(len(name) + len(text) + 4 for name, text in reported.items()) - 100
            assert 0 < head < 2000
        assert 0 < sent("/streams/big.uph", "HEAD")[0] < 2000
        taken = []

        def fetch(**headers):
            status, _, body = client.get("/streams/big.uph", **headers)
            taken.append((status, len(body)))

        pace.counts.clear()
        threads = [threading.Thread(target=fetch) for _ in range(3)]
        threads.append(threading.Thread(target=fetch, kwargs={"range": "bytes=16000-"}))
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert sorted(taken) == [(200, 32_000)] * 3 + [(206, 16_000)]
    assert len(paces) == 1
    assert 112_000 < sum(pace.counts) < 120_000


def test_scripts_are_sent_gzipped_where_that_is_taken(folder, paces):
    with running(folder, rate=512_000) as client:
        plain = client.get("/assets/uph-worker.js")
        status, headers, body = client.get("/assets/uph-worker.js", accept_encoding="br, gzip;q=0.8")
        assert (status, headers["content-encoding"], headers["vary"]) == (200, "gzip", "Accept-Encoding")
        assert 2 * len(body) < len(plain[2])
        assert gzip.decompress(body) == plain[2]
        assert headers["content-type"] == plain[1]["content-type"] == "text/javascript; charset=utf-8"
        again = client.get("/assets/uph-worker.js", accept_encoding="gzip", if_none_match=headers["etag"])
        assert again[::2] == (304, b"")


def test_bytes_arrive_as_they_are_let_go(folder, monkeypatch):
    turns = Turns(monkeypatch)
    data = os.urandom(16_000)
    (folder / "big.uph").write_bytes(data)
    with running(folder, rate=turns.RATE) as client:
        line = http.client.HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE)
        line.request("GET", "/streams/big.uph")
        answer, came = None, b""
        for count in range(640, 16_001, 640):
            turns.release()
            answer = answer or line.getresponse()
            while len(came) < count:
                came += answer.read1(1 << 16)
            # Nothing more comes before its turn.
            assert len(came) == count
        assert came == data
        line.close()
