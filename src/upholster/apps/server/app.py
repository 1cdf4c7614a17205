"""The application: its routes."""

import mimetypes
import os
from collections.abc import Callable, Collection, Sequence

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Scope

from upholster._version import __version__
from upholster.apps.server.catalogue import SUFFIX, Catalogue
from upholster.apps.server.guard import LOCAL_HOSTS, AddedHeaders, Guard, failed
from upholster.apps.server.html_pages import content_security_policy, hosted_page, missing_page, start_page
from upholster.apps.server.http_server import allowed_hosts, listen, run_until_stopped
from upholster.apps.server.throttle import Pace, Throttle
from upholster.apps.server.thumbnails import Thumbnails

__all__ = ["STREAM_TYPE", "make_app", "serve"]

STREAM_TYPE = "model/vnd.upholster"
"""Media type of a stream. Some hosts compress ``application/octet-stream`` in transit, which breaks ranges;
they leave unknown types alone."""

mimetypes.add_type(STREAM_TYPE, SUFFIX)
mimetypes.add_type("text/javascript", ".js")  # on Windows other programs may register another type

_CACHING = {"cache-control": "no-cache"}  # always check whether it has changed
_STREAMS = {"cache-control": "no-cache, no-transform"}  # and do not compress it in transit
_ASSETS = {"cache-control": "max-age=10"}  # a page preloads files that its scripts request a moment later
_SHARED = {"cross-origin-resource-policy": "cross-origin"}


def serve(
    catalogue: Catalogue,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    rate: int | None = None,
    origins: Collection[str] = (),
    frames: Collection[str] = (),
    listening: Callable[[str], None] = print,
) -> None:
    """Serve a catalogue until Ctrl-C (or SIGTERM).

    Processes that draw pictures load the main script again: a script must call this under
    ``if __name__ == "__main__":``.

    Parameters
    ----------
    catalogue
        The streams.
    host, port
        The address to listen on; port 0 chooses any free one.
    rate, origins, frames
        See `make_app`.
    listening
        Called with the start page's address as soon as requests are accepted.

    Raises
    ------
    InputError
        If the host is unknown or the port is not available.
    """
    with listen(host, port) as listener:
        hosts = allowed_hosts(host, listener)
        run_until_stopped(
            make_app(catalogue, rate=rate, origins=origins, frames=frames, hosts=hosts), listener, listening
        )


def make_app(
    catalogue: Catalogue,
    *,
    rate: int | None = None,
    origins: Collection[str] = (),
    frames: Collection[str] = (),
    hosts: Sequence[str] = LOCAL_HOSTS,
) -> ASGIApp:
    """Return the ASGI application that serves a catalogue.

    Parameters
    ----------
    catalogue
        The streams.
    rate
        Bits per second of the line that carries all answers; None for no limit.
    origins
        Origins whose pages may read streams and scripts (not the start page, which lists every stream): as
        browsers write them, or "*" for any.
    frames
        Origins whose pages may show this server's pages in a frame, or "*" for any.
    hosts
        See `upholster.apps.server.guard.Guard`.
    """
    site = _Site(catalogue)
    packed = [Middleware(GZipMiddleware)]
    assets = StaticFiles(packages=[("upholster.output", "web"), ("upholster.apps.server", "static")])
    app = Starlette(
        routes=[
            Route("/", site.start, middleware=packed),
            Route("/view/{name:path}", site.view, middleware=packed),
            Route("/thumbnails/{name:path}.png", site.thumbnail),
            Mount("/streams", _shared(AddedHeaders(_Streams(catalogue), _STREAMS), origins)),
            Mount("/assets", _shared(AddedHeaders(GZipMiddleware(assets), _ASSETS), origins)),
        ],
        exception_handlers={Exception: failed},
    )
    app.router.redirect_slashes = False
    guarded = Guard(app, policy=content_security_policy(frames), hosts=hosts)
    return guarded if rate is None else Throttle(guarded, Pace(rate))


def _shared(app: ASGIApp, origins: Collection[str]) -> ASGIApp:
    """Let pages of other origins read an application's answers."""
    if not origins:
        return app
    return CORSMiddleware(
        AddedHeaders(app, _SHARED),
        allow_origins=origins,
        allow_methods=["GET", "HEAD"],
        allow_headers=["Range", "If-Range", "If-None-Match", "Cache-Control"],
        allow_private_network=True,  # a page from the network may request files from the user's own machine
        expose_headers=["Accept-Ranges", "Content-Length", "Content-Range", "ETag"],
    )


class _Streams(StaticFiles):
    """The streams, served as files by Starlette: a request's path is a name in the catalogue."""

    def __init__(self, catalogue: Catalogue) -> None:
        super().__init__()
        self._catalogue = catalogue

    def get_path(self, scope: Scope) -> str:
        path, root = str(scope["path"]), str(scope["root_path"])
        return path.removeprefix(f"{root}/")

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        return self._catalogue.find(path) or ("", None)


class _Site:
    """The other routes. Handlers that are not async run in a thread."""

    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._thumbnails = Thumbnails()

    def start(self, _request: Request) -> Response:
        return HTMLResponse(start_page(self._catalogue.entries()), headers=_CACHING)

    def view(self, request: Request) -> Response:
        name = request.path_params["name"]
        found = self._catalogue.find(name)
        if found is None:
            return HTMLResponse(missing_page(), 404, _CACHING)
        page = hosted_page(name, found[1].st_size, lab="lab" in request.query_params)
        return HTMLResponse(page, headers=_CACHING)

    async def thumbnail(self, request: Request) -> Response:
        name = request.path_params["name"]
        found = await run_in_threadpool(self._catalogue.find, name)
        if found is None:
            raise HTTPException(404)
        path, status = found
        tag = f'"{__version__}-{status.st_mtime_ns:x}-{status.st_size:x}"'
        headers = _CACHING | {"etag": tag}
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers=headers)
        picture, is_drawn = await self._thumbnails.get(path, status)
        if not is_drawn:
            return Response(picture, 500, {"cache-control": "no-store"}, media_type="image/png")
        return Response(picture, headers=headers, media_type="image/png")
