"""Serving streams and the viewer over HTTP, for the desk and for trying out. Needs the extra ``serve``.

In production any static host does: see docs/serving.md.
"""

from upholster.server.app import STREAM_TYPE, make_app, serve
from upholster.server.browser import open_in_browser
from upholster.server.catalogue import Catalogue
from upholster.server.guard import check_origin
from upholster.server.pages import view_url
from upholster.server.running import serving

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
