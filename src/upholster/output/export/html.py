"""One file that shows a stream in any browser: page, viewer, decoder and stream, opened from disk."""

import base64
import gzip
import hashlib
import html
import os
from importlib import resources

import numpy as np

from upholster._version import __version__
from upholster.base.files import write_bytes

__all__ = ["as_printable_ascii", "html_page", "viewer_page", "write_html"]

_ALPHABET = np.array([code for code in range(33, 127) if chr(code) not in "&<>"], np.uint8)
"""Printable ASCII without HTML's special characters: 91 characters, two of which code 13 bits (91² > 2¹³)."""

_STYLE = """
:root { color-scheme: light dark; font: 1rem/1.5 system-ui, sans-serif }
html, body { height: 100%; margin: 0 }
p { max-width: 32em; margin: 0 auto; padding: 3em 1em }
upholster-viewer { display: block; width: 100%; height: 100% }
noscript p, #note { position: relative; z-index: 2; padding: 1em; background: Canvas }
#poster { position: fixed; inset: 0; z-index: 1; width: 100%; height: 100%; object-fit: contain }
#poster { pointer-events: none }
"""

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="upholster {version}">
<meta name="description" content="A textured 3D model, to be turned and zoomed.">
<meta property="og:title" content="{title}">
<meta property="og:description" content="A textured 3D model, to be turned and zoomed.">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript><p>This page shows a textured model. It needs JavaScript, which is switched off.</p></noscript>
<p id="note" hidden></p>
{poster}
<!--
{licence}
-->
{parts}
<script>{script}</script>
</body>
</html>
"""


def write_html(
    path: str | os.PathLike[str], stream: bytes, *, title: str = "upholster", poster: bytes = b""
) -> None:
    """Write a stream, the viewer and everything that it needs as one HTML file, which needs no network.

    Parameters
    ----------
    path
        The file to write.
    stream
        Bytes of a .uph stream, complete or cut, see `upholster.encode_stream`.
    title
        Title of the page; any text.
    poster
        Bytes of a WebP picture of the model, which the page shows until the viewer has loaded it all, or
        permanently if scripts are switched off; none by default.
    """
    write_bytes(path, viewer_page(stream, title=title, poster=poster))


def viewer_page(stream: bytes, *, title: str = "upholster", poster: bytes = b"") -> bytes:
    """Return the page that `write_html` writes: UTF-8, with upholster's own viewer."""
    shipped = resources.files("upholster.output") / "web"
    viewer, worker = ((shipped / name).read_bytes() for name in ("upholster-viewer.js", "uph-worker.js"))
    return html_page(stream, title=title, viewer=viewer, worker=worker, poster=poster)


def html_page(stream: bytes, *, title: str, viewer: bytes, worker: bytes, poster: bytes = b"") -> bytes:
    """Return a page of a stream and any viewer: UTF-8, the same bytes for the same input.

    The scripts are gzipped, and unpacked by the browser's own ``DecompressionStream``. A content security
    policy allows only these scripts, by their digests, and forbids any connection.

    Parameters
    ----------
    stream, title, poster
        As for `write_html`.
    viewer
        An ES module without imports, UTF-8, that defines the element ``upholster-viewer``: its attribute
        ``worker`` is the worker's URL, its method ``open`` takes the stream as Uint8Array.
    worker
        An ES module without imports: the viewer's Worker.
    """
    script = (resources.files("upholster.output.export") / "page.js").read_text(encoding="utf-8")
    script = "\n" + script.replace("\r\n", "\n")
    policy = {
        "default-src": "'none'",
        "script-src": f"{_digest(script.encode())} {_digest(viewer)}",
        "worker-src": "data:",
        **({"img-src": "data:"} if poster else {}),
        "style-src": _digest(_STYLE.encode()),
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    parts = {
        "viewer": gzip.compress(viewer, 9, mtime=0),
        "worker": gzip.compress(worker, 9, mtime=0),
        "stream": stream,
    }
    page = _PAGE.format(
        policy="; ".join(f"{name} {value}" for name, value in policy.items()),
        version=__version__,
        title=html.escape(title),
        licence=(resources.files("upholster.output") / "web" / "LICENSES.txt")
        .read_text(encoding="utf-8")
        .strip(),
        style=_STYLE,
        poster=_poster(poster, title),
        parts="\n".join(
            f'<script type="application/octet-stream" id="{name}" data-bytes="{len(data)}">'
            f"{as_printable_ascii(data)}</script>"
            for name, data in parts.items()
        ),
        script=script,
    )
    return page.encode()


def _poster(poster: bytes, title: str) -> str:
    if not poster:
        return ""
    data = base64.b64encode(poster).decode()
    return f'<img id="poster" alt="{html.escape(title)}" src="data:image/webp;base64,{data}">'


def as_printable_ascii(data: bytes) -> str:
    """Return bytes as printable ASCII that HTML takes literally: 16 characters for 13 bytes.

    Base64 would take 17.3. Bits are grouped by 13, most significant first; the last group is padded with
    zeros. Group v becomes the characters number v // 91 and v % 91 out of those from ``!`` to ``~`` except
    ``&``, ``<``, ``>``.
    """
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    groups = np.pad(bits, (0, -len(bits) % 13)).reshape(-1, 13) @ (1 << np.arange(12, -1, -1))
    text: bytes = _ALPHABET[np.stack(np.divmod(groups, 91), axis=1)].tobytes()
    return text.decode("ascii")


def _digest(script: bytes) -> str:
    """Return the digest by which a content security policy identifies a script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"
