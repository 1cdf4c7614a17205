"""A page that holds viewer and stream: what it carries, what it allows, what it says where it cannot open."""

import base64
import gzip
import hashlib
import html
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import upholster
from upholster.base.errors import InputError
from upholster.output.export.html import as_printable_ascii, html_page
from upholster.pipeline import refine

sys.path.insert(0, str(Path(__file__).parents[1] / "web"))

from browser import chromium

VIEWER = """customElements.define('upholster-viewer', class extends HTMLElement {
  open(bytes) {
    const worker = new Worker(this.getAttribute('worker'), { type: 'module' })
    worker.onmessage = ({ data }) => { document.body.dataset.sum = data }
    worker.postMessage(bytes)
  }
})
"""
WORKER = """const sum = (data) => data.reduce((a, b) => (31 * a + b) % 65521, 7)
onmessage = ({ data }) => postMessage(`${data.length} ${sum(data)}`)
"""
PATIENCE = 300_000
"""Milliseconds after which what has not come never will."""

STREAM = np.random.default_rng(3).bytes(5000)
HOSTILE = """a"><script>alert(1)</script>&amp;<!-- 'ñ' {title} -->"""
LINE_ENDS = pytest.mark.parametrize("line_end", [b"\n", b"\r\n"], ids=["LF", "CRLF"])


def page(stream: bytes = STREAM, title: str = "ring", viewer: str = VIEWER) -> bytes:
    return html_page(stream, title=title, viewer=viewer.encode(), worker=WORKER.encode())


def unprintable(text: str, length: int) -> bytes:
    """The inverse of `as_printable_ascii`, by one large number."""
    alphabet = "".join(chr(code) for code in range(33, 127) if chr(code) not in "&<>")
    digits = [alphabet.index(c) for c in text]
    number = 0
    for high, low in zip(digits[::2], digits[1::2], strict=True):
        number = number << 13 | (91 * high + low)
    spare = 13 * len(digits) // 2 - 8 * length
    assert 0 <= spare < 13
    assert number & ((1 << spare) - 1) == 0
    return (number >> spare).to_bytes(length)


def part(page: bytes, name: str) -> bytes:
    """What a page carries."""
    found = re.search(rf'<script [^>]*id="{name}" data-bytes="(\d+)">([^<]*)</script>', page.decode())
    assert found is not None
    return unprintable(found[2], int(found[1]))


def digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@pytest.mark.parametrize("length", [0, 1, 2, 12, 13, 14, 1000])
def test_printable_says_every_byte(length: int) -> None:
    rng = np.random.default_rng(length)
    for data in (rng.bytes(length), b"\xff" * length, bytes(length)):
        text = as_printable_ascii(data)
        assert unprintable(text, length) == data
        assert len(text) == 2 * -(-8 * length // 13)
        assert not set(text) & set("&<> \r\n")


def test_a_page_holds_stream_and_scripts() -> None:
    made = page()
    assert part(made, "stream") == STREAM
    assert gzip.decompress(part(made, "viewer")).decode() == VIEWER
    assert gzip.decompress(part(made, "worker")).decode() == WORKER
    assert page() == made


def test_only_its_own_scripts_run_and_nothing_is_fetched() -> None:
    text = page().decode()
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert rules.pop("default-src") == rules.pop("base-uri") == rules.pop("form-action") == "'none'"
    assert rules.pop("script-src").split() == [digest(script), digest(VIEWER)]
    assert rules.pop("style-src") == digest(style)
    assert rules == {"worker-src": "data:"}
    assert not re.search(r"\b(?:src|href)\s*=|@import|url\(", text)
    assert text.index("Content-Security-Policy") < text.index("<style>")


def test_a_poster_is_seen_before_any_script() -> None:
    poster = np.random.default_rng(4).bytes(100)
    made = html_page(b"", title=HOSTILE, viewer=b"", worker=b"", poster=poster).decode()
    ((alt, data),) = re.findall(r'<img id="poster" alt="([^"]*)" src="data:image/webp;base64,([^"]*)">', made)
    assert html.unescape(alt) == HOSTILE
    assert base64.b64decode(data) == poster
    assert "; img-src data:; " in made
    assert made.index(data) < made.index('<script type="application/octet-stream"')


def test_names_are_escaped() -> None:
    text = page(title=HOSTILE).decode()
    (title,) = re.findall(r"<title>(.*?)</title>", text)
    assert html.unescape(title) == HOSTILE
    assert "<" not in title
    assert text.count("<script") == page().decode().count("<script") == 4
    assert text.count("-->") == 1


@pytest.fixture(scope="module")
def woven() -> Any:
    exemplar = np.random.default_rng(0).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    surface = upholster.plane()
    quilt = upholster.synthesize(exemplar, surface, texels=(48, 64), seed=2)
    return exemplar, surface, quilt


@pytest.mark.slow(reason="writes and reads whole models")
@pytest.mark.parametrize(
    "options", [{}, {"sample_quality": "lossless"}, {"stream_bytes": 700}, {"wavelet": "haar"}]
)
def test_the_stream_is_what_a_stream_file_holds(tmp_path: Path, woven: Any, options: Any) -> None:
    exemplar, surface, quilt = woven
    texels = upholster.paint(quilt, exemplar)
    for name in ("a.uph", "a & b.html"):
        settled = upholster.WriteOptions(**options)
        upholster.write(tmp_path / name, surface, texels, quilt=quilt, exemplar=exemplar, options=settled)
    written = (tmp_path / "a & b.html").read_bytes()
    assert part(written, "stream") == (tmp_path / "a.uph").read_bytes()
    assert b"<title>a &amp; b</title>" in written
    assert written.isascii()


def test_a_cut_stream_is_written_as_to_a_stream_file(tmp_path: Path, woven: Any) -> None:
    exemplar, surface, quilt = woven
    (tmp_path / "cut.uph").write_bytes(upholster.encode_stream(surface, quilt, exemplar)[:900])
    done = refine(tmp_path / "cut.uph", [str(tmp_path / name) for name in ("a.uph", "a.html")])
    assert not done.complete
    assert part((tmp_path / "a.html").read_bytes(), "stream") == (tmp_path / "a.uph").read_bytes()
    assert done.written[str(tmp_path / "a.html")] == (tmp_path / "a.html").stat().st_size


def test_texels_alone_make_no_page(tmp_path: Path, woven: Any) -> None:
    exemplar, surface, quilt = woven
    painted = upholster.paint(quilt, exemplar)
    with pytest.raises(InputError, match="quilt"):
        upholster.write(tmp_path / "a.html", surface, upholster.Texels(painted.charts, painted.arrays))
    assert not list(tmp_path.iterdir())


# In Chromium, from disk.


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as running:
        yield running


def opened(browser: Any, path: Path, *, before: str = "", **settings: Any) -> tuple[Any, list[str]]:
    """A page from disk, and what it complains of or asks for."""
    tab = browser.new_context(offline=True, **settings).new_page()
    found: list[str] = []
    tab.on("console", lambda message: found.append(f"{message.type}: {message.text}"))
    tab.on("pageerror", lambda error: found.append(f"error: {error}"))
    tab.on("request", lambda request: found.append(request.url[:99]))
    report = (
        "addEventListener('securitypolicyviolation', e => console.error(e.violatedDirective, e.blockedURI));"
    )
    tab.add_init_script(report + before)
    tab.goto(path.as_uri())
    found.remove(path.as_uri())
    return tab, found


@pytest.mark.browser
@LINE_ENDS
def test_a_page_opens_from_disk(browser: Any, tmp_path: Path, line_end: bytes) -> None:
    path = tmp_path / "a ring.html"
    path.write_bytes(page(title=HOSTILE).replace(b"\n", line_end))
    tab, found = opened(browser, path)
    tab.wait_for_selector("body[data-sum]", timeout=PATIENCE)
    total = 7
    for value in STREAM:
        total = (31 * total + value) % 65521
    assert tab.get_attribute("body", "data-sum") == f"{len(STREAM)} {total}"
    assert tab.title() == HOSTILE
    assert tab.inner_text("body").strip() == ""
    assert [line for line in found if not line.startswith("data:text/javascript,")] == []


@pytest.mark.browser
@pytest.mark.parametrize(
    ("before", "settings", "said"),
    [
        ("delete window.DecompressionStream", {}, "cannot unpack it"),
        ("HTMLCanvasElement.prototype.getContext = () => null", {}, "needs WebGL 2"),
        ("", {"java_script_enabled": False}, "needs JavaScript"),
    ],
)
def test_what_a_browser_lacks_is_said(
    browser: Any, tmp_path: Path, before: str, settings: Any, said: str
) -> None:
    (tmp_path / "a.html").write_bytes(page())
    tab, found = opened(browser, tmp_path / "a.html", before=before, **settings)
    tab.wait_for_selector("p:visible", timeout=PATIENCE)
    assert said in tab.inner_text("body")
    assert found == []


@pytest.mark.browser
@pytest.mark.parametrize(
    ("name", "put", "said"),
    [("stream", b"", "is cut"), ("worker", b"", "is cut"), ("viewer", b"~" * 40, "cannot be shown: ")],
)
def test_a_damaged_page_says_so(browser: Any, tmp_path: Path, name: str, put: bytes, said: str) -> None:
    made = page()
    start = made.index(b">", made.index(f'id="{name}"'.encode())) + 1
    (tmp_path / "a.html").write_bytes(made[:start] + put + made[start + 40 :])
    tab, _ = opened(browser, tmp_path / "a.html")
    tab.wait_for_selector("p:visible", timeout=PATIENCE)
    assert said in tab.inner_text("body")
    assert tab.query_selector("upholster-viewer") is None


@pytest.mark.browser
def test_the_shipped_viewer_opens_from_disk(browser: Any, tmp_path: Path, woven: Any) -> None:
    exemplar, surface, quilt = woven
    texels = upholster.paint(quilt, exemplar)
    upholster.write(tmp_path / "a.html", surface, texels, quilt=quilt, exemplar=exemplar)
    tab, found = opened(browser, tmp_path / "a.html")
    whole = "() => document.querySelector('upholster-viewer')?.model?.complete"
    tab.wait_for_function(whole, timeout=PATIENCE)
    # The poster is there until then.
    tab.wait_for_selector("#poster", state="detached", timeout=PATIENCE)
    allowed = ("data:text/javascript,", "data:image/webp;", "blob:")
    assert [line for line in found if not line.startswith(allowed)] == []


@pytest.mark.browser
def test_the_shipped_page_shows_a_picture_without_scripts(browser: Any, tmp_path: Path, woven: Any) -> None:
    exemplar, surface, quilt = woven
    texels = upholster.paint(quilt, exemplar)
    upholster.write(tmp_path / "a.html", surface, texels, quilt=quilt, exemplar=exemplar)
    tab, found = opened(browser, tmp_path / "a.html", java_script_enabled=False)
    tab.wait_for_selector("#poster", timeout=PATIENCE)
    assert tab.locator("#poster").bounding_box()["height"] == tab.viewport_size["height"]
    assert tab.locator("#poster").evaluate("(image) => image.naturalWidth") == 320
    assert found == []
    assert "needs JavaScript" in tab.inner_text("body")
