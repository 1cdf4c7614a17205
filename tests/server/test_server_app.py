"""What the server answers, on real connections."""

import gzip
import http.client
import os
import re
import socket
import sys
import threading
import time
from functools import partial
from pathlib import Path

import anyio.to_thread
import numpy as np
import pytest
from live_server import PATIENCE, VECTORS, Turns, running, wait_until

from upholster.apps.server import check_origin, connections, thumbnail_picture, thumbnails
from upholster.apps.server.html_pages import THUMBNAIL_SIZE, content_security_policy, script_digest
from upholster.base.errors import InputError
from upholster.base.limits import Limits
from upholster.image.files.read import read_image

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX file systems")


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shared") / "given"
    folder.mkdir()
    (folder.parent / "secret.uph").write_bytes(b"secret")
    (folder / "quilt.uph").write_bytes((VECTORS / "quilt.uph").read_bytes())
    with running(folder) as client:
        yield client, folder


def test_a_stream_is_its_bytes(shared):
    client, folder = shared
    data = (folder / "quilt.uph").read_bytes()
    status, headers, body = client.get("/streams/quilt.uph", accept_encoding="gzip, br")
    assert (status, body) == (200, data)
    assert headers["content-type"] == "model/vnd.upholster"
    assert headers["content-length"] == str(len(data))
    assert headers["accept-ranges"] == "bytes"
    assert headers["cache-control"] == "no-cache, no-transform"
    assert "content-encoding" not in headers
    assert re.fullmatch(r'"[0-9a-f]{32}"', headers["etag"])
    head = client.get("/streams/quilt.uph", "HEAD")
    assert head[0] == 200
    assert head[2] == b""
    assert {**head[1], "date": ""} == {**headers, "date": ""}


def test_a_stream_in_parts(shared):
    client, folder = shared
    data = (folder / "quilt.uph").read_bytes()
    tag = client.get("/streams/quilt.uph")[1]["etag"]
    for text, start, stop in (
        ("0-99", 0, 100),
        ("3000-", 3000, len(data)),
        ("-7", len(data) - 7, len(data)),
    ):
        status, headers, body = client.get("/streams/quilt.uph", range=f"bytes={text}", if_range=tag)
        assert (status, body) == (206, data[start:stop])
        assert headers["content-range"] == f"bytes {start}-{stop - 1}/{len(data)}"
        assert headers["etag"] == tag
    status, headers, body = client.get("/streams/quilt.uph", range=f"bytes={len(data)}-")
    assert status == 416
    assert headers["content-range"] == f"bytes */{len(data)}"
    status, headers, body = client.get("/streams/quilt.uph", range="bytes=4-5,0-1,1-2")
    assert status == 206
    assert headers["content-type"].startswith("multipart/byteranges; boundary=")
    assert len(body) == int(headers["content-length"])
    parts = [part.partition(b"\r\n\r\n")[2] for part in body.split(b"\r\n--")]
    assert parts[:2] == [data[:3], data[4:6]]
    for text in ("bytes=5-1", "lines=0-1", "bytes=x"):
        status, _, body = client.get("/streams/quilt.uph", range=text)
        assert (status, body.count(b"\n")) == (400, 0)
    assert client.get("/streams/quilt.uph", range="bytes=0-1", if_range='"other"')[::2] == (200, data)
    assert client.get("/streams/quilt.uph", if_none_match=tag)[::2] == (304, b"")


def test_one_connection_carries_many_answers(shared):
    client, folder = shared
    whole = (folder / "quilt.uph").stat().st_size
    line = http.client.HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE)
    for _ in range(3):
        for path, size in (("/streams/quilt.uph", whole), ("/streams/none.uph", 9), ("/view/none", None)):
            line.request("GET", path)
            body = line.getresponse().read()
            assert size in (None, len(body))
    line.close()


def test_the_tag_follows_the_file(shared):
    client, folder = shared
    path = folder / "changing.uph"
    data = (folder / "quilt.uph").read_bytes()
    path.write_bytes(data)
    first = client.get("/streams/changing.uph")[1]["etag"]
    tick(folder)
    path.write_bytes(bytes(len(data)))  # of the same length
    status, headers, body = client.get("/streams/changing.uph", if_none_match=first)
    assert (status, body) == (200, bytes(len(data)))
    second = headers["etag"]
    assert second != first
    os.utime(path, (10**9, 10**9))
    assert client.get("/streams/changing.uph", if_none_match=second)[0] == 200
    date = client.get("/streams/changing.uph")[1]["last-modified"]
    assert date == "Sun, 09 Sep 2001 01:46:40 GMT"
    assert client.get("/streams/changing.uph", if_modified_since=date)[::2] == (304, b"")


def tick(folder):
    """Wait until the file system's clock has moved on."""
    probe = folder / "clock"
    probe.touch()
    before = probe.stat().st_mtime_ns

    def moved():
        probe.touch()
        return probe.stat().st_mtime_ns > before

    wait_until(moved)


def opened(client, path):
    line = http.client.HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE)
    line.request("GET", path)
    return line, line.getresponse()


def test_a_file_that_is_replaced_while_it_is_sent_stays_what_it_was(folder, monkeypatch):
    old, new = os.urandom(40_000), os.urandom(40_000)
    (folder / "big.uph").write_bytes(old)
    turns = Turns(monkeypatch)
    with running(folder, rate=turns.RATE) as client:
        turns.release(10)
        line, answer = opened(client, "/streams/big.uph")
        start = answer.read(5000)
        (folder / "new").write_bytes(new)
        os.replace(folder / "new", folder / "big.uph")
        turns.release(1000)
        assert start + answer.read() == old
        tag = answer.headers["etag"]
        line.close()
        status, headers, body = client.get("/streams/big.uph", range="bytes=39000-", if_range=tag)
        assert status == 200
        assert body == new
        assert headers["etag"] != tag


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("why", ["goes", "stalls"])
def test_the_file_is_closed_when_the_client(folder, monkeypatch, why):
    path = folder / "big.uph"
    path.write_bytes(bytes(16 << 20))

    def is_open():
        links = Path("/proc/self/fd").iterdir()
        return str(path) in [os.readlink(link) for link in links if link.is_symlink()]

    turns = Turns(monkeypatch)
    with running(folder, rate=turns.RATE) as client:
        turns.release()
        line, answer = opened(client, "/streams/big.uph")
        answer.read(640)
        assert is_open()
        if why == "goes":
            line.sock.close()
            line.close()
        else:
            monkeypatch.setattr(connections, "STALLED_SECONDS", 0.3)
            turns.release(1 << 20)
        wait_until(lambda: not is_open())
        line.close()


SECRETS = [
    "/streams/../secret.uph",
    "/streams/%2e%2e/secret.uph",
    "/streams/%2e%2e%2fsecret.uph",
    "/streams/%252e%252e%252fsecret.uph",
    "/streams/..%5csecret.uph",
    "/streams/..\\secret.uph",
    "/streams/quilt.uph/../../secret.uph",
    "/streams//{folder}/../secret.uph",
    "/streams/%2f{folder}%2f..%2fsecret.uph",
    "/streams/file:///{folder}/../secret.uph",
    "/streams/quilt.uph%00",
    "/streams/%00",
    "/streams/..%00/secret.uph",
    "/streams/..%c0%af..%c0%afsecret.uph",
    "/streams/secret.uph",
    "/streams/",
    "/streams",
    "/streams/.",
    "/streams/..",
    "/streams/%",
    "/streams/%ff",
    "/streams/quilt.uph/",
    "/streams/QUILT.uph%0a",
    "/view/../secret.uph",
    "/view/secret.uph",
    "/thumbnails/../secret.uph.png",
    "/thumbnails/secret.uph.png",
    "/thumbnails/quilt.uph",
    "/assets/../apps/server/app.py",
    "/assets/..%2fserver%2fapp.py",
    "/assets/%2e%2e/server/app.py",
    "/assets/app.py",
    "/assets/",
    "/assets",
    "/secret.uph",
    "/../secret.uph",
    "//",
    "/index.html",
    "http://127.0.0.1/streams/secret.uph",
    "/streams/" + "a" * 10_000,
]


@pytest.mark.parametrize("path", SECRETS, ids=range(len(SECRETS)))
def test_nothing_else_is_found(shared, path):
    client, folder = shared
    path = path.replace("{folder}", str(folder).lstrip("/"))
    status, headers, body = client.get(path)
    assert status == 404
    assert b"secret" not in body
    assert "location" not in headers


def test_odd_requests_get_short_answers(shared):
    client, _ = shared
    host = b"Host: 127.0.0.1\r\nConnection: close\r\n"
    for method in (b"POST", b"PUT", b"DELETE", b"TRACE", b"OPTIONS", b"PROPFIND", b"X" * 1000):
        for path in (b"/", b"/streams/quilt.uph", b"/assets/page.css", b"/thumbnails/quilt.uph.png"):
            answer = client.raw(method + b" " + path + b" HTTP/1.1\r\n" + host + b"\r\n")
            assert answer.startswith(b"HTTP/1.1 405 "), method
    for text in (
        b"\r\n\r\n\r\nnonsense\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"GET / HTTP/1.1\r\n" + host + b"X: " + b"y" * 200_000 + b"\r\n\r\n",
        b"GET /" + b"a" * 200_000 + b" HTTP/1.1\r\n" + host + b"\r\n",
        b"GET /\xff HTTP/1.1\r\n" + host + b"\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + host + b"Transfer-Encoding: nonsense\r\n\r\n",
    ):
        try:
            answer = client.raw(text)
        except ConnectionError:  # refused before all was sent
            continue
        assert re.match(rb"HTTP/1.1 [45]\d\d |$", answer), text[:40]
        assert b"Traceback" not in answer
    # A body that nobody asked for does not hurt.
    answer = client.raw(b"GET / HTTP/1.1\r\n" + host + b"Content-Length: 5\r\n\r\nhello")
    assert answer.startswith(b"HTTP/1.1 200 ")
    # Of Range lines given twice the first counts.
    answer = client.raw(
        b"GET /streams/quilt.uph HTTP/1.1\r\n" + host + b"Range: bytes=0-1\r\nRange: bytes=2-3\r\n\r\n"
    )
    assert answer.startswith(b"HTTP/1.1 206 ")


def test_nothing_is_read_behind_a_request_of_two_lengths(shared):
    client, _ = shared
    head = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    smuggled = head + b"\r\n"
    with socket.create_connection(("127.0.0.1", client.port), timeout=PATIENCE) as line:
        line.sendall(head + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + smuggled)
        answer = b""
        while part := line.recv(1 << 16):  # until it is closed
            answer += part
    assert answer.count(b"HTTP/1.1 ") == 1
    assert b"connection: close" in answer.lower()


def test_every_answer_has_the_headers_that_keep_browsers_careful(shared):
    client, _ = shared
    assets = ("/assets/page.css", "/assets/uph-worker.js")
    for path in ("/", "/view/quilt.uph", "/view/none", "/none", "/streams/quilt.uph", *assets):
        for method in ("GET", "POST"):
            _, headers, _ = client.get(path, method)
            assert headers["content-security-policy"] == content_security_policy()
            assert headers["x-content-type-options"] == "nosniff"
            assert headers["referrer-policy"] == "no-referrer"
            assert headers["cross-origin-resource-policy"] == "same-origin"
            assert "server" not in headers
            assert "access-control-allow-origin" not in headers


def test_pages_are_packed_where_that_is_taken(shared):
    client, _ = shared
    for path in ("/", "/view/quilt.uph", "/view/none"):
        status, headers, page = client.get(path)
        assert (headers["vary"], "content-encoding" in headers) == ("Accept-Encoding", False)
        packed = client.get(path, accept_encoding="br, gzip")
        assert (packed[0], packed[1]["content-encoding"]) == (status, "gzip")
        assert gzip.decompress(packed[2]) == page


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "localhost.evil.example", "10.0.0.1", "", "[", "a@b"]
)
def test_a_foreign_host_name_is_refused(shared, host):
    status, headers, body = shared[0].get("/", host=host)
    assert status == 400
    assert b"quilt" not in body
    assert "content-security-policy" in headers


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8000", "a.localhost", "127.0.0.1:1", "[::1]:8000"])
def test_its_addresses_and_localhost_are_answered_to(shared, host):
    assert shared[0].get("/", host=host)[0] == 200


def test_any_host_name_where_the_server_is_meant_for_others(folder):
    with running(folder, hosts=["*"]) as client:
        assert client.get("/", host="example.org")[0] == 200


def test_pages_name_the_streams_safely(folder, monkeypatch):
    drawn_by(monkeypatch, lambda *_: b"")
    name = "<script>alert('1')</script>&\"x\".uph" if sys.platform != "win32" else "&amp;'x'.uph"
    stream = (folder / "smallest.uph").read_bytes()
    name = name.replace("/", "")
    (folder / name).write_bytes(stream)
    with running(folder) as client:
        status, headers, body = client.get("/")
        page = body.decode()
        assert status == 200
        assert headers["content-type"] == "text/html; charset=utf-8"
        assert page.count("<li>") == 3
        assert "<script" not in page
        assert name not in page
        assert f"{(folder / 'quilt.uph').stat().st_size / 1000:.3g} kB" in page
        links = re.findall(r'href="(/view/[^"]+)"', page)
        pictures = re.findall(r'src="(/thumbnails/[^"]+)"', page)
        assert len(links) == len(pictures) == 3
        for link in links:
            status, _, body = client.get(link)
            page = body.decode()
            assert status == 200
            scripts = re.findall("<script[^>]*>", page)
            source = re.search(r'<upholster-viewer src="(/streams/[^"]+)">', page)[1]
            early = f'<script data-stream="{source}">'
            assert scripts == [early, '<script type="module" src="/assets/upholster-viewer.js">']
            script = page.partition(early)[2].partition("</script>")[0]
            assert script_digest(script) in content_security_policy()
            assert 'controls="lab"' not in page
            assert 'controls="lab"' in client.get(f"{link}?lab")[2].decode()
            assert not re.search(r"\sstyle=|<style|\son\w+=", page)
            assert client.get(source)[0] == 200
        for picture in pictures:
            assert client.get(picture, "HEAD")[0] == 200
        (folder / "later.uph").write_bytes(stream)
        assert b"later.uph" in client.get("/")[2]
    assert "No such stream" in client_page(folder, "/view/none.uph")


def client_page(folder, path):
    with running(folder) as client:
        status, _, body = client.get(path)
        assert status == 404
        return body.decode()


def test_an_empty_folder_is_a_page_too(tmp_path):
    with running(tmp_path) as client:
        assert b"No streams here yet" in client.get("/")[2]


def test_assets_are_the_shipped_ones(shared):
    client, _ = shared
    status, headers, body = client.get("/assets/page.css")
    assert (status, headers["content-type"]) == (200, "text/css; charset=utf-8")
    assert b"prefers-color-scheme: dark" in body
    assert client.get("/assets/page.css", if_none_match=headers["etag"])[0] == 304
    for name, kind in (
        ("upholster-viewer.js", "javascript"),
        ("upholster-lab.js", "javascript"),
        ("upholster-environment.js", "javascript"),
        ("uph-worker.js", "javascript"),
        ("uph-picture.js", "javascript"),
        ("LICENSES.txt", "plain"),
    ):
        status, headers, _ = client.get(f"/assets/{name}")
        assert status in (200, 404)  # 404: not built yet
        assert status == 404 or kind in headers["content-type"]


def drawn_by(monkeypatch, draw):
    """Let a function of the stream's path draw, in a thread."""
    monkeypatch.setattr(thumbnails, "_picture", partial(anyio.to_thread.run_sync, draw))


def honest(path):
    with open(path, "rb") as file:
        return thumbnail_picture.draw_thumbnail(file)


def sleep_long(_path):
    time.sleep(10 * PATIENCE)


def mistaken(_path):
    raise ValueError("a mistake\nof ours")


@pytest.mark.slow(reason="starts processes")
def test_a_thumbnail_is_a_picture_that_is_remembered(folder, tmp_path, monkeypatch):
    drawn = []
    drawn_by(monkeypatch, lambda path: drawn.append(1) or honest(path))
    with running(folder) as client:
        answers = []
        asking = [
            threading.Thread(target=lambda: answers.append(client.get("/thumbnails/quilt.uph.png")))
            for _ in range(5)
        ]
        for thread in asking:
            thread.start()
        for thread in asking:
            thread.join()
        (status, headers, body), *others = answers
        assert status == 200
        assert headers["content-type"] == "image/png"
        assert all(other[2] == body for other in others)
        assert len(drawn) == 1
        (tmp_path / "a.png").write_bytes(body)
        pixels = read_image(tmp_path / "a.png")
        assert pixels.shape == (*THUMBNAIL_SIZE[::-1], 3)
        assert pixels.std() > 10
        assert client.get("/thumbnails/quilt.uph.png", if_none_match=headers["etag"])[::2] == (304, b"")
        (folder / "quilt.uph").write_bytes((folder / "quilt.uph").read_bytes()[:2000])
        assert client.get("/thumbnails/quilt.uph.png", if_none_match=headers["etag"])[0] == 200
        assert len(drawn) == 2


def test_what_cannot_be_shown_says_so(folder, tmp_path, monkeypatch):
    stream = bytearray((folder / "quilt.uph").read_bytes())
    (folder / "short.uph").write_bytes(stream[:20])
    (folder / "empty.uph").write_bytes(b"")
    stream[-300] ^= 0xFF
    (folder / "bad.uph").write_bytes(stream)
    (folder / "notes.uph").write_bytes(b"these are notes")
    drawn_by(monkeypatch, honest)
    with running(folder) as client:
        pictures = {}
        for name in ("short", "empty", "bad", "notes"):
            status, _, pictures[name] = client.get(f"/thumbnails/{name}.uph.png")
            assert status == 200
            (tmp_path / "a.png").write_bytes(pictures[name])
            pixels = read_image(tmp_path / "a.png")
            assert len(np.unique(pixels[:, :, 1])) > 20, name  # there are words
            assert (pixels[:20] == pixels[0, 0]).all()
        assert len(set(pictures.values())) == 4


def test_a_model_of_very_many_texels_is_shown_bare(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(thumbnail_picture, "_PAINTED", Limits(texels=1))
    drawn_by(monkeypatch, honest)
    with running(folder) as client:
        (tmp_path / "a.png").write_bytes(client.get("/thumbnails/quilt.uph.png")[2])
    pixels = read_image(tmp_path / "a.png").astype(int)
    assert pixels.std() > 10
    assert np.ptp(pixels, axis=2).max() < 30  # clay: nearly grey


def test_a_mesh_has_a_picture_as_other_surfaces_have():
    picture = honest(VECTORS / "mesh.uph")
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 5000  # a placeholder's few words are smaller


@pytest.mark.slow(reason="starts processes")
@pytest.mark.parametrize(
    ("draw", "why"), [(sleep_long, "takes too much time"), (mistaken, "ValueError: a mistake of ours")]
)
def test_a_picture_that_fails_is_given_up_and_that_is_remembered(folder, monkeypatch, capsys, draw, why):
    in_process = thumbnails._picture
    drawn_by(monkeypatch, draw)
    if draw is sleep_long:  # in a process, for that can be ended
        monkeypatch.setattr(thumbnails, "_picture", in_process)
        monkeypatch.setattr(thumbnails, "draw_file", draw)
        monkeypatch.setattr(thumbnails, "_MOST_SECONDS", 3)
    with running(folder) as client:
        given_up = client.get("/thumbnails/quilt.uph.png")
        assert given_up[0] == 500
        assert given_up[1]["cache-control"] == "no-store"
        assert given_up[2].startswith(b"\x89PNG")
        assert client.get("/thumbnails/quilt.uph.png")[::2] == given_up[::2]
        reported = capsys.readouterr().err
        assert reported.count("\n") == reported.count("upholster: picture of 'quilt.uph' failed: ") == 1
        assert why in reported
        monkeypatch.setattr(thumbnails, "draw_file", thumbnail_picture.draw_file)
        monkeypatch.setattr(thumbnails, "_MOST_SECONDS", PATIENCE)
        if draw is mistaken:
            drawn_by(monkeypatch, honest)
        assert client.get("/thumbnails/smallest.uph.png")[0] == 200  # the next one is drawn


def test_what_failed_is_tried_again_later(folder, monkeypatch, capsys):
    monkeypatch.setattr(thumbnails, "_FAILED_SECONDS", 0)
    drawn = []

    def draw(_):
        drawn.append(1)
        if len(drawn) == 1:
            raise ValueError("busy")
        return b"drawn"

    drawn_by(monkeypatch, draw)
    with running(folder) as client:
        assert client.get("/thumbnails/quilt.uph.png")[0] == 500
        assert client.get("/thumbnails/quilt.uph.png")[::2] == (200, b"drawn")
    assert "busy" in capsys.readouterr().err


def test_a_slow_picture_does_not_hold_up_the_others(folder, monkeypatch):
    begun, go_on = threading.Event(), threading.Event()

    def draw(path):
        if path.endswith("quilt.uph"):
            begun.set()
            go_on.wait(PATIENCE)
        return b"drawn"

    drawn_by(monkeypatch, draw)
    with running(folder) as client:
        slow = threading.Thread(target=client.get, args=("/thumbnails/quilt.uph.png",))
        slow.start()
        assert begun.wait(PATIENCE)
        assert client.get("/thumbnails/smallest.uph.png")[2] == b"drawn"
        assert slow.is_alive()
        go_on.set()
        slow.join()


def test_what_is_remembered_does_not_wait_for_what_is_drawn(folder, monkeypatch):
    begun, go_on = threading.Event(), threading.Event()
    drawn_by(monkeypatch, lambda *_: b"known")
    with running(folder) as client:
        assert client.get("/thumbnails/quilt.uph.png")[2] == b"known"
        drawn_by(monkeypatch, lambda _: (begun.set(), go_on.wait(PATIENCE), b"late")[2])
        waiting = threading.Thread(target=client.get, args=("/thumbnails/smallest.uph.png",))
        waiting.start()
        assert begun.wait(PATIENCE)
        assert client.get("/thumbnails/quilt.uph.png")[2] == b"known"
        assert waiting.is_alive()
        go_on.set()
        waiting.join()


def test_few_thumbnails_are_kept(folder, monkeypatch):
    monkeypatch.setattr(thumbnails, "_MOST_REMEMBERED", 2)
    drawn = []
    drawn_by(monkeypatch, lambda path: drawn.append(Path(path).name) or b"drawn")
    for n in range(3):
        (folder / f"{n}.uph").write_bytes(bytes([n]))
    with running(folder) as client:
        for n in (0, 1, 0, 2, 1, 2, 0):
            assert client.get(f"/thumbnails/{n}.uph.png")[0] == 200
    assert drawn == ["0.uph", "1.uph", "2.uph", "0.uph"]


def test_what_was_drawn_from_a_file_in_the_making_is_not_remembered(folder, monkeypatch):
    data = (folder / "quilt.uph").read_bytes()
    drawn = []

    def draw(*_):
        drawn.append(1)
        if len(drawn) == 1:
            (folder / "quilt.uph").write_bytes(data[:100])
        return b"%d" % len(drawn)

    drawn_by(monkeypatch, draw)
    with running(folder) as client:
        assert client.get("/thumbnails/quilt.uph.png")[2] == b"1"
        (folder / "quilt.uph").write_bytes(data)
        assert client.get("/thumbnails/quilt.uph.png")[2] == b"2"
        assert client.get("/thumbnails/quilt.uph.png")[2] == b"2"


def test_pages_and_streams_come_while_a_thumbnail_is_made(folder, monkeypatch):
    begun, go_on = threading.Event(), threading.Event()

    def draw(*_):
        begun.set()
        return b"" if go_on.wait(PATIENCE) else b"nobody waited"

    drawn_by(monkeypatch, draw)
    with running(folder) as client:
        waiting = threading.Thread(target=client.get, args=("/thumbnails/quilt.uph.png",))
        waiting.start()
        assert begun.wait(PATIENCE)
        assert client.get("/")[0] == 200
        assert client.get("/streams/quilt.uph")[0] == 200
        assert waiting.is_alive()
        go_on.set()
        waiting.join()


def test_a_mistake_of_ours_is_one_line_here_and_nothing_there(folder, monkeypatch, capsys):
    def broken(*_):
        raise RuntimeError("internal\nmatters")

    monkeypatch.setattr("upholster.apps.server.app.start_page", broken)
    with running(folder) as client:
        status, headers, body = client.get("/")
        assert (status, body) == (500, b"Internal Server Error")
        assert "content-security-policy" in headers
        assert client.get("/streams/smallest.uph")[0] == 200
    assert capsys.readouterr().err == "upholster: GET '/' failed: RuntimeError: internal matters\n"


def test_streams_are_shared_with_the_origins_that_are_named(folder):
    origin = "https://shop.example"
    with running(folder, origins=[origin]) as client:
        path = "/streams/quilt.uph"
        _, headers, _ = client.get(path, origin=origin)
        assert headers["access-control-allow-origin"] == origin
        assert "ETag" in headers["access-control-expose-headers"]
        assert headers["vary"] == "Origin"
        assert headers["cross-origin-resource-policy"] == "cross-origin"
        assert "access-control-allow-origin" in client.get(path, origin=origin, range="bytes=99999-")[1]
        for wanted, foreign in (
            (path, "https://evil.example"),
            (path, "null"),
            ("/", origin),
            ("/view/quilt.uph", origin),
        ):
            assert "access-control-allow-origin" not in client.get(wanted, origin=foreign)[1]
        assert client.get(path)[1]["vary"] == "Origin"
        asked = {"origin": origin, "access_control_request_method": "GET"}
        status, headers, _ = client.get(
            path,
            "OPTIONS",
            access_control_request_headers="if-range",
            access_control_request_private_network="true",
            **asked,
        )
        assert status == 200
        assert "If-Range" in headers["access-control-allow-headers"]
        assert headers["access-control-allow-private-network"] == "true"
        assert client.get("/", "OPTIONS", **asked)[0] == 405
        status, headers, _ = client.get(path, "OPTIONS", **{**asked, "origin": "https://evil.example"})
        assert status == 400
        assert "access-control-allow-origin" not in headers
    with running(folder, origins=["*"]) as client:
        headers = client.get(path, origin="https://any.example")[1]
        assert headers["access-control-allow-origin"] == "*"


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        ("*", "*"),
        ("https://Example.org", "https://example.org"),
        ("http://localhost:3000", "http://localhost:3000"),
        ("https://example.org:443", "https://example.org"),
        ("http://[::1]:80", "http://[::1]"),
    ],
)
def test_origins(text, origin):
    assert check_origin(text) == origin


@pytest.mark.parametrize(
    "text",
    [
        "",
        "example.org",
        "https://",
        "https://a/",
        "https://a/b",
        "https://a?b",
        "ftp://a",
        "https://u@a",
        "https://a:x",
        "**",
    ],
)
def test_what_is_no_origin(text):
    with pytest.raises(InputError, match="origin"):
        check_origin(text)
