"""Serving streams and the viewer over HTTP, for local use and for trials. Needs the extra ``serve``.

In production any static host will do: see docs/serving.md.

Any application on the user's machine can use `guard` (Host check, headers, one-line error reports),
`http_server` (a free port, until Ctrl-C or while a block runs; on `connections` with deadlines),
`browser` and `throttle`. Streams are served by `catalogue`, `html_pages`, `thumbnails` (drawn by
`thumbnail_picture`) and `app`, which joins them all.
"""

from upholster.apps.server.app import STREAM_TYPE, make_app, serve
from upholster.apps.server.browser import open_in_browser
from upholster.apps.server.catalogue import Catalogue
from upholster.apps.server.guard import check_origin
from upholster.apps.server.html_pages import view_url
from upholster.apps.server.http_server import serving

__all__ = [
    "STREAM_TYPE",
    "Catalogue",
    "check_origin",
    "make_app",
    "open_in_browser",
    "serve",
    "serving",
    "view_url",
]
