"""Chromium, drawing by the processor, and a server of streams and pages behind one line."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = [
    "ARGUMENTS",
    "PAGES",
    "SIZE",
    "WEB",
    "Line",
    "find_chromium",
    "fresh_page",
    "open_chromium",
    "serve_files",
]

PAGES = Path(__file__).parent / "web_pages"
WEB = Path(__file__).parent.parent / "web"
SIZE = (640, 480)
MOST_SECONDS = 600
ARGUMENTS = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--no-sandbox",
)
"""The processor draws. As root, which machines of CI are, it has no sandbox."""


@dataclass
class Line:
    """A server's address, and the bytes of all answers' bodies so far, as they are sent."""

    address: str
    sent: int = 0


def find_chromium() -> str | None:
    """Return the path of a browser; none: None.

    The first of these has the same engine without a window's parts: it draws the same in less time.
    """
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


@contextmanager
def open_chromium(what: str) -> Iterator[Any]:
    """Start a browser; None, with a message, where something is missing."""
    browser = find_chromium()
    if browser is None or not (WEB / "node_modules" / "three").is_dir():
        print(f"{what}: skipped; it needs Chromium, and `npm ci` in web/")
        yield None
        return
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        print(f"{what}: skipped; it needs Playwright: pip install 'upholster[test]'")
        yield None
        return
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=browser, args=[*ARGUMENTS])
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def serve_files(folder: Path, pages: Path = PAGES, rate: int | None = None) -> Iterator[Line]:
    """Serve a folder's streams as ``upholster serve`` does, its other files and pages under ``/bench``.

    Beside a page may lie the same as Brotli, ``NAME.br``, which is sent instead. `rate` is of the one line
    that carries everything, in bits per second.
    """
    from starlette.applications import Starlette
    from starlette.middleware.gzip import GZipMiddleware
    from starlette.requests import Request
    from starlette.responses import FileResponse
    from starlette.routing import Mount, Route
    from starlette.staticfiles import StaticFiles
    from starlette.types import Message, Receive, Scope, Send

    from upholster.apps.server import Catalogue, make_app, serving
    from upholster.apps.server.throttle import Pace, Throttle

    async def page(request: Request) -> FileResponse:
        path = pages / request.path_params["name"]
        packed = path.with_name(f"{path.name}.br")
        if not packed.is_file():
            return FileResponse(path)
        media_type = FileResponse(path).media_type
        return FileResponse(packed, headers={"content-encoding": "br"}, media_type=media_type)

    own = Starlette(
        routes=[
            Mount("/bench/web", GZipMiddleware(StaticFiles(directory=WEB, follow_symlink=True))),
            Mount("/bench/models", StaticFiles(directory=folder)),
            Route("/bench/{name}", page),
        ]
    )
    streams = make_app(Catalogue([str(path) for path in folder.glob("*.uph")]))
    line = Line("")

    async def either(scope: Scope, receive: Receive, send: Send) -> None:
        async def counted(message: Message) -> None:
            line.sent += len(message.get("body", b""))
            await send(message)

        is_own = scope["type"] == "http" and scope["path"].startswith("/bench/")
        await (own if is_own else streams)(scope, receive, counted)

    with serving(either if rate is None else Throttle(either, Pace(rate))) as address:
        line.address = address.rstrip("/")
        yield line


@contextmanager
def fresh_page(chromium: Any) -> Iterator[Any]:
    """Make a page of a browser that knows nothing yet; it notes times by ``watch.js``."""
    context = chromium.new_context(viewport={"width": SIZE[0], "height": SIZE[1]}, bypass_csp=True)
    try:
        page = context.new_page()
        page.set_default_timeout(1000 * MOST_SECONDS)
        page.add_init_script((PAGES / "watch.js").read_text(encoding="utf-8"))
        yield page
    finally:
        context.close()
