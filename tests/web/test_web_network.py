"""The viewer on lines that break, and with files that are no good: what it has it keeps, and says so."""

from itertools import pairwise
from typing import Any

import anyio
import browser
import pytest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from upholster.apps.server import Catalogue, make_app

STREAM = "/streams/ring.uph"
REFUSED = "Failed to load resource"
"""What Chromium writes to the console of a request that fails, whatever a page does about it."""

SEEN = """
globalThis.seen = []
const note = ({ detail }) => seen.push(detail.bytes)
for (const type of ['first', 'refine']) addEventListener(type, note, { capture: true })
"""

pytestmark = pytest.mark.browser


class Line:
    """The application behind a line that breaks.

    `breaks` are the bytes of the stream after which each of its answers ends too early, one after the other;
    None: it does not. Without `ranges` the whole file is always sent. `then` is the application from the
    second answer on.
    """

    def __init__(
        self, app: ASGIApp, *breaks: int | None, ranges: bool = True, then: ASGIApp | None = None
    ) -> None:
        self._app, self._then, self._ranges = app, then, ranges
        self._breaks = list(breaks)
        self._broken = 0
        self.asked: list[str] = []
        self.sent: list[int] = []

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] != STREAM:
            await self._app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        app = self._then if self.asked and self._then else self._app
        self.asked.append(headers.get(b"range", b"").decode())
        number = len(self.sent)
        self.sent.append(0)
        room = self._breaks.pop(0) if self._breaks else None
        if not self._ranges:
            headers.pop(b"range", None)

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.body" and room is not None:
                left = room - self.sent[number]
                # What is never said to be the last piece makes the server close the connection.
                message = {**message, "body": message.get("body", b"")[:left], "more_body": True}
            self.sent[number] += len(message.get("body", b""))
            await send(message)

        await app({**scope, "headers": list(headers.items())}, receive, sending)
        # A browser drops what it has not handed over to the page yet when the connection breaks.
        while room and self._broken < len(self.sent):
            await anyio.sleep(0.01)

    def break_after(self, tab: Any, *received: int) -> None:
        """Let connections break, one after the other, when the page has so many bytes."""
        for count in received:
            tab.until(f"viewer.model?.received === {count}")
            self._broken = len(self.sent)


def _app(folder: Any, **options: Any) -> Any:
    return make_app(Catalogue([str(folder)]), **options)


def _only(tab: Any, *known: str) -> None:
    """Nothing else is wrong than what was provoked."""
    assert [one for one in tab.found_wrong() if not any(text in one for text in known)] == []


@pytest.fixture
def bad(chromium: Any) -> Any:
    """A page on which errors are provoked."""
    with browser.tab(chromium, faultless=False) as new:
        yield new


def _failed(tab: Any, address: str) -> str:
    """Go to a stream that is no good; what the viewer says."""
    tab.open(address)
    tab.until("inside.querySelector('.note button')?.checkVisibility()")
    return str(tab.note())


@pytest.fixture(scope="module")
def whole(chromium: Any, site: Any) -> Any:
    """The texels of the ring that came without trouble."""
    with browser.tab(chromium) as tab:
        tab.open(f"{site}/view/ring.uph").complete().settle_shape()
        return tab.texels()


def test_a_cut_stream_shows_what_there_is_and_says_so(bad: Any, site: Any, streams: Any) -> None:
    count = (streams / "cut.uph").stat().st_size
    said = _failed(bad, f"{site}/view/cut.uph")
    assert f"cut.uph ends after {count / 1000:.0f} kB of {len(browser.ring()) / 1000:.0f} kB." in said
    assert "the rest is missing" in said
    assert bad.settle()["bytes"] == count
    assert bad.call("return viewer.model.complete") is False
    # It can be looked at as any other.
    assert bad.limit(bytes=5000)["bytes"] == 5000
    _only(bad)


def test_a_damaged_stream_keeps_the_picture_and_says_where(bad: Any, site: Any, streams: Any) -> None:
    said = _failed(bad, f"{site}/view/damaged.uph")
    assert "damaged.uph is damaged after" in said
    assert "The picture shows what was loaded before." in said
    shown = bad.settle()
    assert 1000 < shown["bytes"] <= (streams / "damaged.uph").stat().st_size
    assert shown["placements"] == 1
    assert bad.picture()[:, :, :3].std() > 20
    _only(bad)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("words.uph", "words.uph is no .uph stream."),
        ("short.uph", "That is too little for a picture."),
    ],
)
def test_what_can_not_be_shown_is_reported(bad: Any, site: Any, name: str, says: str) -> None:
    assert says in _failed(bad, f"{site}/view/{name}")
    assert bad.call("return viewer.model.first") is False
    _only(bad)


def test_what_is_not_there_is_reported_and_another_can_be_opened(bad: Any, site: Any) -> None:
    bad.open(f"{site}/view/material.uph").complete()
    bad.call("viewer.open('/streams/nowhere.uph')")
    bad.until("inside.querySelector('.note').checkVisibility()")
    assert "nowhere.uph was not found." in bad.note()
    bad.call("viewer.open('/streams/material.uph')")
    bad.complete()
    assert bad.note() == ""
    _only(bad, REFUSED)


def test_a_lost_connection_is_taken_up_where_it_broke(bad: Any, streams: Any, whole: Any) -> None:
    line = Line(_app(streams), 0, 9_000, 5, 12_000)
    with browser.serving(line) as address:
        bad.open(f"{address}/view/ring.uph")
        line.break_after(bad, 9_000, 9_005, 21_005)
        bad.complete()
    total = len(browser.ring())
    # The page itself asks for the first bytes, before the scripts are here.
    assert line.asked == ["bytes=0-4095", "", "bytes=9000-", "bytes=9005-", "bytes=21005-"]
    assert sum(line.sent) == total
    bad.settle_shape()
    assert bad.texels() == whole
    assert bad.note() == ""
    assert bad.settle()["bytes"] == total
    _only(bad, REFUSED)


def test_a_server_without_ranges_sends_it_again(bad: Any, streams: Any, whole: Any) -> None:
    line = Line(_app(streams), 9_000, 20_000, ranges=False)
    with browser.serving(line) as address:
        bad.open(f"{address}/view/ring.uph")
        line.break_after(bad, 9_000, 20_000)
        bad.complete()
    assert line.sent == [9_000, 20_000, len(browser.ring())]
    bad.settle_shape()
    assert bad.texels() == whole
    _only(bad, REFUSED)


@pytest.mark.parametrize("ranges", [True, False])
def test_a_file_that_changes_meanwhile_is_not_mixed(
    bad: Any, streams: Any, tmp_path: Any, ranges: bool
) -> None:
    (tmp_path / "ring.uph").write_bytes(browser.ball())
    line = Line(_app(streams), 3_000, ranges=ranges, then=_app(tmp_path))
    with browser.serving(line) as address:
        bad.open(f"{address}/view/ring.uph")
        line.break_after(bad, 3_000)
        bad.until("inside.querySelector('.note button').checkVisibility()")
        assert "ring.uph was replaced while it was loading." in bad.note()
    assert bad.settle()["bytes"] == 3_000
    assert bad.call("return viewer.model.complete") is False
    _only(bad, REFUSED)


def test_a_server_that_is_gone_for_good(bad: Any, streams: Any) -> None:
    line = Line(_app(streams), 3_000, *([0] * 20))
    with browser.serving(line) as address:
        bad.open(f"{address}/view/ring.uph")
        line.break_after(bad, 3_000)
        # The note goes while the viewer tries again, so it is read as soon as it is seen.
        note = "inside.querySelector('.note')"
        bad.until(f"{note}.checkVisibility() && {note}.textContent.includes('Connection lost, trying again')")
        assert bad.settle()["bytes"] == 3_000
    _only(bad, REFUSED)


def test_a_slow_line_brings_ever_more_of_the_stream(bad: Any, streams: Any) -> None:
    counts = (8_000, 14_000, 20_000)
    breaks = [more - less for less, more in pairwise((0, *counts))]
    line = Line(_app(streams), 0, *breaks)  # the page's own first request fails
    with browser.serving(line) as address:
        bad.page.add_init_script(SEEN)
        bad.open(f"{address}/view/ring.uph")
        for count in counts:
            bad.until(f"seen.at(-1) === {count}")
            line.break_after(bad, count)
        bad.complete()
        bad.until(f"seen.at(-1) === {len(browser.ring())}")
        seen = bad.page.evaluate("seen")
    assert seen == sorted(seen)
    assert set(counts) < set(seen)
    _only(bad, REFUSED)
