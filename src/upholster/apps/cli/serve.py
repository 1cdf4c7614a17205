"""``upholster serve`` and ``upholster view``: streams over HTTP, and in the browser."""

import re
from contextlib import AbstractContextManager
from types import ModuleType
from typing import Annotated

import typer

from upholster.apps.cli.console import say
from upholster.base.errors import InputError

__all__ = ["serve", "view"]

_PORTS = "The port; 0: any free one."


def serve(
    paths: Annotated[
        list[str],
        typer.Argument(help="Streams (.uph), and folders with streams.", metavar="FILE-OR-FOLDER"),
    ],
    port: Annotated[int, typer.Option(help=_PORTS)] = 8000,
    host: Annotated[
        str, typer.Option(help="The address to listen on; 0.0.0.0: all, so that other machines can connect.")
    ] = "127.0.0.1",
    throttle: Annotated[
        str | None,
        typer.Option(metavar="RATE", help="Bits per second of the line that all answers share: 256k, 2M."),
    ] = None,
    cors: Annotated[
        list[str] | None,
        typer.Option(metavar="ORIGIN", help="Origin whose pages may read the streams; *: any. Repeatable."),
    ] = None,
    embed: Annotated[
        list[str] | None,
        typer.Option(metavar="ORIGIN", help="Origin whose pages may frame these pages; *: any. Repeatable."),
    ] = None,
) -> None:
    """Serve streams and a page to look at them, until Ctrl-C."""
    rate = _rate(throttle)
    server = _server()
    origins = [server.check_origin(origin) for origin in cors or []]
    frames = [server.check_origin(origin, "embed") for origin in embed or []]
    catalogue = server.Catalogue(paths)

    def listening(url: str) -> None:
        found = len(catalogue.entries())
        streams = "1 stream" if found == 1 else f"{found:,} streams"
        say(f"serving {streams} at {url} (Ctrl-C stops)")

    with _compiling():
        server.serve(
            catalogue,
            host=host,
            port=port,
            rate=rate,
            origins=origins,
            frames=frames,
            listening=listening,
        )


def view(
    paths: Annotated[list[str], typer.Argument(help="Streams.", metavar="FILE.uph")],
    port: Annotated[int, typer.Option(help=_PORTS)] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
) -> None:
    """Show streams in the browser, until Ctrl-C."""
    server = _server()
    catalogue = server.Catalogue(paths)
    if catalogue.folders:
        raise InputError("view shows .uph files; for a folder's files use: upholster serve FOLDER")
    names = [entry.name for entry in catalogue.entries()]

    def listening(url: str) -> None:
        page = url.rstrip("/") + server.view_url(names[0]) if len(names) == 1 else url
        opened = browser and server.open_in_browser(page)
        say(f"{'opened' if opened else 'open'} {page} in a browser (Ctrl-C stops)")

    with _compiling():
        server.serve(catalogue, port=port, listening=listening)


def _server() -> ModuleType:
    try:
        import upholster.apps.server
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in ("anyio", "starlette", "uvicorn", "h11"):
            raise
        raise InputError(
            "this needs Starlette and uvicorn; install them with: pip install 'upholster[serve]'"
        ) from None
    return upholster.apps.server


def _compiling() -> AbstractContextManager[None]:
    # Compiles the kernels for pictures of streams while the server already answers.
    from upholster.runtime.warm import compiling_apart

    return compiling_apart(
        ["refine picture", "refine paper", "refine material"],
        "compiling {} kernels, once for this machine and version: pictures of streams follow",
    )


def _rate(text: str | None) -> int | None:
    """Read a number of bits per second: ``256k``, ``2M``."""
    if text is None:
        return None
    found = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,6})?)(k|M|G)?", text.strip())
    rate = int(float(found[1]) * {None: 1, "k": 1000, "M": 10**6, "G": 10**9}[found[2]]) if found else 0
    if not 1000 <= rate <= 10**11:
        raise InputError(f"throttle is {text!r}; allowed: bits per second such as 256k or 2M, at least 1k")
    return rate
