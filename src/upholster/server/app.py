"""The application: which address gives what."""

import os
import sys
from collections.abc import Collection
from io import FileIO
from pathlib import Path

import anyio.to_thread
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from upholster._version import __version__
from upholster.errors import printable
from upholster.server.catalogue import Catalogue, open_regular
from upholster.server.drawing import placeholder
from upholster.server.guard import Guard
from upholster.server.pages import missing_page, start_page, viewer_page
from upholster.server.sending import (
    accepts,
    file_response,
    packed_response,
    page_response,
    unchanged_response,
    validators,
)
from upholster.server.throttle import Pace, Throttle
from upholster.server.thumbnails import DrawingError, Thumbnails
from upholster.server.versions import Version, Versions

__all__ = ["STREAM_TYPE", "make_app"]

STREAM_TYPE = "model/vnd.upholster"
"""Media type of a stream. There are hosts that compress ``application/octet-stream`` on the way, which ranges
do not survive; a type that they do not know they leave alone."""

_PACKAGE = Path(__file__).parent.parent
_SCRIPTS = (
    "upholster-viewer.js",
    "upholster-lab.js",
    "upholster-environment.js",
    "uph-worker.js",
    "uph-picture.js",
)
_ASSETS = {
    "page.css": (_PACKAGE / "server", "text/css; charset=utf-8"),
    **dict.fromkeys(_SCRIPTS, (_PACKAGE / "web", "text/javascript; charset=utf-8")),
    "LICENSES.txt": (_PACKAGE / "web", "text/plain; charset=utf-8"),
}


def make_app(
    catalogue: Catalogue,
    *,
    rate: int | None = None,
    origins: Collection[str] = (),
    frames: Collection[str] = (),
    local: bool = True,
) -> ASGIApp:
    """Return the ASGI application that serves a catalogue.

    Parameters
    ----------
    catalogue
        The streams.
    rate
        Bits per second of the line that carries all that is sent; None: as fast as it goes.
    origins, frames, local
        See `upholster.server.guard.Guard`.
    """
    pace = Pace(rate)
    site = _Site(catalogue, pace.piece)
    app = Starlette(
        routes=[
            Route("/", site.start),
            Route("/view/{name:path}", site.view),
            Route("/streams/{name:path}", site.stream),
            Route("/thumbnails/{name:path}.png", site.thumbnail),
            Route("/assets/{name}", site.asset),
        ],
        exception_handlers={Exception: _failed},
    )
    app.router.redirect_slashes = False
    guarded = Guard(app, origins=origins, frames=frames, local=local)
    return guarded if rate is None else Throttle(guarded, pace)


class _Site:
    """The answers."""

    def __init__(self, catalogue: Catalogue, piece: int) -> None:
        self._catalogue = catalogue
        self._piece = piece
        self._versions = Versions()
        self._thumbnails = Thumbnails()

    async def start(self, request: Request) -> Response:
        entries = await anyio.to_thread.run_sync(self._catalogue.entries)
        return await page_response(request, start_page(entries))

    async def view(self, request: Request) -> Response:
        file = await anyio.to_thread.run_sync(self._catalogue.open, request.path_params["name"])
        if file is None:
            return await page_response(request, missing_page(), 404)
        with file:
            size = file.seek(0, 2)
        page = viewer_page(request.path_params["name"], size, lab="lab" in request.query_params)
        return await page_response(request, page)

    async def stream(self, request: Request) -> Response:
        found = await anyio.to_thread.run_sync(self._stream, request.path_params["name"])
        if not isinstance(found, Version):
            return found
        return file_response(request, found, STREAM_TYPE, piece=self._piece)

    async def thumbnail(self, request: Request) -> Response:
        found = await anyio.to_thread.run_sync(self._stream, request.path_params["name"])
        if not isinstance(found, Version):
            return found
        with found.file:
            tag = f'"{__version__}-{found.tag[1:]}'
            if (known := unchanged_response(request, tag)) is not None:
                return known
            try:
                picture = await self._thumbnails.get(found, gone=request.is_disconnected)
            except DrawingError as error:
                if not error.is_known:
                    await _failed(request, error)
                picture = placeholder("no preview", str(error))
                return Response(picture, 500, {"cache-control": "no-store"}, media_type="image/png")
        if picture is None:
            return PlainTextResponse("Nobody waits for this.", 503)
        return Response(picture, headers=validators(tag), media_type="image/png")

    async def asset(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in _ASSETS:
            return _missing()
        folder, media_type = _ASSETS[name]
        found = await anyio.to_thread.run_sync(self._asset, os.path.realpath(folder / name))
        if not isinstance(found, Version):
            return found
        if accepts(request, "gzip"):
            return await packed_response(request, found, media_type)
        return file_response(request, found, media_type, piece=self._piece)

    def _stream(self, name: str) -> Version | Response:
        """Return a stream's version, or what to answer if there is none."""
        file = self._catalogue.open(name)
        return _missing() if file is None else self._identified(file)

    def _asset(self, path: str) -> Version | Response:
        try:
            return self._identified(open_regular(path))
        except OSError:
            return _missing()

    def _identified(self, file: FileIO) -> Version | Response:
        version = self._versions.identify(file)
        if version is None:
            file.close()
            return PlainTextResponse("This file is being written.", 503, {"retry-after": "1"})
        return version


def _missing() -> Response:
    return PlainTextResponse("Not Found", 404)


async def _failed(request: Request, error: Exception) -> Response:
    """Print for the operator what went wrong, in one line, and tell the client only that something did."""
    words = " ".join(f"{type(error).__name__}: {error}".split())
    print(printable(f"upholster: {request.method} {request.url.path!r} failed: {words}"), file=sys.stderr)
    return PlainTextResponse("Internal Server Error", 500)
