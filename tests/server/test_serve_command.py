"""upholster serve and view as a user meets them; browsers that are no browsers."""

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
import webbrowser
from contextlib import nullcontext

import pytest
from command_line import assert_one_line, run_cli
from live_server import PATIENCE, wait_until

from upholster.apps import server
from upholster.apps.server import open_in_browser

# Where the cache is empty, kernels are compiled, and the user reads so.
REPORTED = "compiling "
COMMAND = [sys.executable, "-m", "upholster"]
QUIET = {
    name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
}


@pytest.fixture(autouse=True)
def _no_helpers(monkeypatch):
    monkeypatch.setattr("upholster.runtime.warm.compiling_apart", lambda *_: nullcontext())


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
@pytest.mark.parametrize(
    ("arguments", "printed", "stop"),
    [
        (
            ["serve", ".", "--port", "0", "--host", "0.0.0.0", "--throttle", "8k"],
            r"serving 2 streams at (http://127\.0\.0\.1:\d+/) \(Ctrl-C stops\)$",
            signal.SIGTERM,
        ),
        (
            ["view", "quilt.uph"],
            r"open (http://127\.0\.0\.1:\d+/view/quilt\.uph) in a browser \(Ctrl-C stops\)$",
            signal.SIGINT,
        ),
    ],
)
def test_it_prints_its_address_answers_there_and_stops(folder, arguments, printed, stop):
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        cwd=folder,
        env=QUIET,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        line = process.stdout.readline()
        found = re.match(printed, line)
        assert found, line
        host, path = re.match(r"http://([^/]+)(/.*)", found[1]).groups()
        idle, busy = (http.client.HTTPConnection(host, timeout=PATIENCE) for _ in range(2))
        idle.request("GET", path)
        answer = idle.getresponse()
        assert answer.status == 200
        answer.read()
        busy.request("GET", "/streams/quilt.uph")
        busy.getresponse()
        # Whoever is still connected, even in the middle of a stream, does not keep it from stopping.
        process.send_signal(stop)
        output, errors = process.communicate(timeout=PATIENCE)
        assert (process.returncode, output) == (0, "")
        assert all(line.startswith(REPORTED) for line in errors.splitlines())
        idle.close()
        busy.close()
    finally:
        process.kill()
        process.communicate()


@pytest.mark.slow(reason="starts processes")
def test_processes_take_nothing_from_the_working_directory(folder):
    for name in ("anyio", "pickle", "runpy", "subprocess", "upholster"):
        (folder / f"{name}.py").write_text("raise SystemExit")
    code = (  # a busy machine may take longer for a picture than a reader is made to wait
        "from upholster.apps.server import thumbnails; thumbnails._MOST_SECONDS = 600; "
        "from upholster.apps.cli import main; main()"
    )
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", code, "serve", ".", "--port", "0"],
        cwd=folder,
        env=QUIET,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        (address,) = re.findall(r"http://\S+", process.stdout.readline())
        with urllib.request.urlopen(f"{address}thumbnails/quilt.uph.png", timeout=PATIENCE) as answer:
            assert answer.status == 200
    finally:
        process.kill()
        process.communicate()


@pytest.mark.parametrize(
    ("arguments", "opened", "printed"),
    [
        (["quilt.uph"], True, "opened http://127.0.0.1:1/view/quilt.uph in a browser"),
        (["quilt.uph"], False, "open http://127.0.0.1:1/view/quilt.uph in a browser"),
        (["quilt.uph", "--no-browser"], None, "open http://127.0.0.1:1/view/quilt.uph in a browser"),
        (["quilt.uph", "smallest.uph"], True, "opened http://127.0.0.1:1/ in a browser"),
    ],
)
def test_view_opens_the_page(folder, monkeypatch, arguments, opened, printed):
    urls = []
    monkeypatch.setattr(server, "serve", lambda _, *, port, listening: listening("http://127.0.0.1:1/"))
    monkeypatch.setattr(server, "open_in_browser", lambda url: urls.append(url) or opened)
    done = run_cli("view", *arguments, cwd=folder)
    assert (done.returncode, done.stdout) == (0, f"{printed} (Ctrl-C stops)\n")
    assert urls == ([] if opened is None else [printed.split()[1]])


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["serve"], "Missing argument"),
        (["serve", ".", "--port", "many"], "port"),
        (["serve", "none.uph"], "none.uph"),
        (["serve", "notes.txt"], ".txt"),
        (["serve", "bad.uph"], "bad.uph"),
        (["serve", "quilt.uph", "bad.uph"], "bad.uph"),
        (["serve", "empty.uph"], "empty.uph"),
        (["serve", ".", "--throttle", "fast"], "throttle"),
        (["serve", ".", "--throttle", "10"], "throttle"),
        (["serve", ".", "--cors", "example.org"], "cors"),
        (["serve", ".", "--port", "70000"], "port"),
        (["serve", ".", "--port", "TAKEN"], "is in use"),
        (["serve", ".", "--host", "no.such.host.invalid"], "no.such.host.invalid"),
        (["serve", ".", "--host", "192.0.2.1"], "192.0.2.1"),
        (["view", "."], "serve"),
        (["view", "none.uph"], "none.uph"),
        (["view", "bad.uph"], "bad.uph"),
        (["view", "quilt.uph", "--port", "TAKEN"], "is in use"),
    ],
)
def test_bad_input_is_refused_before_the_server_starts(folder, arguments, named):
    (folder / "notes.txt").write_text("notes")
    (folder / "empty.uph").touch()
    stream = bytearray((folder / "quilt.uph").read_bytes())
    stream[-300] ^= 0xFF
    (folder / "bad.uph").write_bytes(stream)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        arguments = [port if argument == "TAKEN" else argument for argument in arguments]
        assert_one_line(run_cli(*arguments, cwd=folder), named)


@pytest.mark.parametrize("missing", ["starlette", "uvicorn"])
def test_without_the_extra_it_says_what_to_install(folder, monkeypatch, missing):
    for name in [name for name in sys.modules if name.startswith(("upholster.apps.server", f"{missing}."))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("upholster.apps.server")
    monkeypatch.setitem(sys.modules, missing, None)
    done = run_cli("serve", ".", cwd=folder)
    assert_one_line(done)
    assert done.stderr.strip() == (
        "upholster: this needs Starlette and uvicorn; install them with: pip install 'upholster[serve]'"
    )


def test_help_needs_no_server():
    code = (
        "import sys, upholster.apps.cli; "
        "print([n for n in ('starlette', 'uvicorn', 'numpy') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


class Opened:
    """A browser that remembers what it was asked to open."""

    def __init__(self, name):
        self.name, self.urls, self.asked = name, [], threading.Event()

    def open(self, url):
        self.urls.append(url)
        self.asked.set()


@pytest.fixture
def desk(monkeypatch):
    monkeypatch.setattr("upholster.apps.server.browser.sys.platform", "linux")
    for name in ("WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", ":0")
    return monkeypatch


def test_a_browser_with_a_window_is_asked(desk):
    browser = Opened("firefox")
    desk.setattr(webbrowser, "get", lambda: browser)
    assert open_in_browser("http://127.0.0.1:1/")
    assert browser.asked.wait(PATIENCE)
    assert browser.urls == ["http://127.0.0.1:1/"]
    desk.delenv("DISPLAY")
    assert not open_in_browser("http://127.0.0.1:1/")


@pytest.mark.parametrize("name", ["lynx", "/usr/bin/w3m", "www-browser", "elinks"])
def test_a_browser_in_the_terminal_is_not(desk, name):
    desk.setattr(webbrowser, "get", lambda: webbrowser.GenericBrowser([name, "%s"]))
    assert not open_in_browser("http://127.0.0.1:1/")


def test_no_browser_at_all(desk):
    def none():
        raise webbrowser.Error("could not locate runnable browser")

    desk.setattr(webbrowser, "get", none)
    assert not open_in_browser("http://127.0.0.1:1/")


@pytest.mark.skipif(sys.platform == "win32", reason="needs a shell script")
@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # that a browser goes on running
def test_the_browser_that_the_user_names_is_not_waited_for(desk, tmp_path):
    script, got, closed = (tmp_path / name for name in ("browse", "got", "closed"))
    script.write_text(
        f'#!/bin/sh\necho "$1" $$ > {got}.part\nmv {got}.part {got}\nsleep 10000\ntouch {closed}\n'
    )
    script.chmod(0o755)
    desk.delenv("DISPLAY")
    desk.setenv("BROWSER", str(script))
    desk.setattr(webbrowser, "get", lambda: webbrowser.GenericBrowser([str(script), "%s"]))
    before = set(threading.enumerate())
    assert open_in_browser("http://127.0.0.1:1/")
    assert not closed.exists()
    wait_until(got.exists)
    url, process = got.read_text().split()
    assert url == "http://127.0.0.1:1/"
    assert os.getsid(int(process)) != os.getsid(0)  # Ctrl-C does not reach it
    for thread in set(threading.enumerate()) - before:
        thread.join()
    os.killpg(int(process), signal.SIGKILL)
