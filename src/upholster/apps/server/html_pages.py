"""The start page and the viewer's page: static HTML. Their scripts are the viewer, and one that preloads."""

import base64
import hashlib
from collections.abc import Collection, Sequence
from html import escape
from urllib.parse import quote

from upholster._version import __version__
from upholster.apps.server.catalogue import ListedStream

__all__ = [
    "EARLY_SCRIPT",
    "content_security_policy",
    "hosted_page",
    "missing_page",
    "script_digest",
    "start_page",
    "stream_url",
    "view_url",
]  # fmt: skip

EARLY_SCRIPT = """
(({ stream }) => {
  const response = fetch(stream, { headers: { Range: 'bytes=0-4095' } })
  response.catch(() => {})
  const worker = new Worker('/assets/uph-worker.js', { type: 'module' })
  globalThis.upholsterEarly = { url: stream, response, worker }
})(document.currentScript.dataset)
"""
"""Requests the stream's beginning and starts the worker while the viewer's script is still loading. The rest
of the stream follows the scripts, which share the line with it. See web/uph-workers.js."""

THUMBNAIL_SIZE = (400, 300)
"""(width, height) in pixels of the pictures on the start page."""

# Four blocks of a quilt, in colours that show on light and dark tabs.
_ICON = quote(
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 8'><path fill='#b5542d' d='M0 0h4v4h4v4H4V4H0z'/>"
    "<path fill='#e0a96d' d='M4 0h4v4H4zM0 4h4v4H0z'/></svg>"
)
_HEAD = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<link rel="icon" href="data:image/svg+xml,{icon}">
<link rel="stylesheet" href="/assets/page.css">
{more}</head>
"""
_VIEWER = (
    '<script data-stream="{stream}">' + EARLY_SCRIPT.replace("{", "{{").replace("}", "}}") + "</script>\n"
    '<script type="module" src="/assets/upholster-viewer.js"></script>\n'
)


def script_digest(script: str) -> str:
    """Return a script's digest for a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def content_security_policy(frames: Collection[str] = ()) -> str:
    """Return the minimum policy for the pages; `frames` are origins whose pages may show them in a frame."""
    return (
        f"default-src 'none'; script-src 'self' {script_digest(EARLY_SCRIPT)}; worker-src 'self'; "
        "connect-src 'self'; img-src 'self' blob: data:; style-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors " + (" ".join(frames) or "'none'")
    )


def stream_url(name: str) -> str:
    """Return the path of a stream's bytes."""
    return f"/streams/{quote(name)}"


def view_url(name: str) -> str:
    """Return the path of the page that shows a stream."""
    return f"/view/{quote(name)}"


def start_page(entries: Sequence[ListedStream]) -> str:
    """Return the start page: a card per stream with its picture, name and size."""
    cards = "\n".join(_card(entry) for entry in entries)
    count = "1 stream" if len(entries) == 1 else f"{len(entries):,} streams"
    empty = '<p class="empty">No streams here yet. Reload this page when there are.</p>'
    return f"""{_head("upholster")}<body class="start">
<header><h1>upholster</h1><p>{count}</p></header>
<main>
{f'<ul class="cards">{chr(10)}{cards}{chr(10)}</ul>' if entries else empty}
</main>
<footer>upholster {__version__} · <a href="/assets/LICENSES.txt">licences</a></footer>
</body>
</html>
"""


def hosted_page(name: str, size: int, *, lab: bool = False) -> str:
    """Return the page that shows one stream, `lab` with the laboratory."""
    address = escape(stream_url(name))
    attributes, other, label = (' controls="lab"', "", "Viewer") if lab else ("", "?lab", "Laboratory")
    return f"""{_head(name, _VIEWER.format(stream=address))}<body class="viewer">
<header><a class="back" href="/">All streams</a><h1><bdi>{escape(name)}</bdi></h1>
<a href="{escape(view_url(name))}{other}">{label}</a> <a href="{address}" download>{_size(size)}</a></header>
<main><upholster-viewer src="{address}"{attributes}></upholster-viewer>
<noscript><p class="empty">The viewer needs JavaScript.</p></noscript></main>
</body>
</html>
"""


def missing_page() -> str:
    """Return the page for a stream that does not exist."""
    return f"""{_head("No such stream")}<body class="start">
<header><h1>No such stream</h1></header>
<main><p class="empty">It may have been moved or deleted. <a href="/">All streams</a></p></main>
</body>
</html>
"""


def _head(title: str, more: str = "") -> str:
    return _HEAD.format(title=escape(title), icon=_ICON, more=more)


def _card(entry: ListedStream) -> str:
    width, height = THUMBNAIL_SIZE
    picture = escape(f"/thumbnails/{quote(entry.name)}.png")
    return (
        f'<li><a href="{escape(view_url(entry.name))}">'
        f'<img src="{picture}" alt="" width="{width}" height="{height}" loading="lazy">'
        f"<span><bdi>{escape(entry.name)}</bdi> <small>{_size(entry.size)}</small></span></a></li>"
    )


def _size(count: int) -> str:
    if count < 1000:
        return f"{count} bytes"
    for unit in ("kB", "MB"):
        count_of = count / (1000 if unit == "kB" else 10**6)
        if count_of < 999.5:
            break
    return f"{count_of:.3g} {unit}"
