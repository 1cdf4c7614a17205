"""``upholster studio``: a page on which a project is made by hand."""

import re
import signal
from typing import Annotated

import typer

from upholster.apps.cli.console import compiled, say
from upholster.base.errors import InputError

__all__ = ["studio"]


def studio(
    files: Annotated[
        list[str] | None,
        typer.Argument(help="A photo or material, a model or surface, or a project.", metavar="FILE"),
    ] = None,
    port: Annotated[int, typer.Option(help="The port; 0: any free one.")] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    save_to: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Allow saving files in this folder, besides downloading them."),
    ] = None,
    limit: Annotated[str, typer.Option(metavar="512M", help="Refuse larger files: 16M, 2G.")] = "512M",
) -> None:
    """Open the studio in the browser: drop a photo and a model, change settings, save. Until Ctrl-C."""
    most_bytes = _bytes(limit)
    try:
        from upholster.apps.studio.routes import run_studio
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in ("anyio", "starlette", "uvicorn", "h11"):
            raise
        raise InputError(
            "the studio needs Starlette and uvicorn; install them with: pip install 'upholster[studio]'"
        ) from None
    compiled(["quilt mesh stream", "quilt stream", "quilt mesh material stream", "prepare"], False)

    def listening(page: str, opened: bool) -> None:
        say(f"{'opened' if opened else 'open'} {page} in a browser (Ctrl-C stops)")

    signal.signal(signal.SIGINT, signal.default_int_handler)
    run_studio(
        files or [], port=port, browser=browser, save_to=save_to, most_bytes=most_bytes, listening=listening
    )


def _bytes(text: str) -> int:
    found = re.fullmatch(r"([0-9]{1,6})([kMG])", text.strip())
    count = int(found[1]) * {"k": 10**3, "M": 10**6, "G": 10**9}[found[2]] if found else 0
    if not 10**5 <= count <= 10**11:
        raise InputError(f"limit is {text!r}; allowed: bytes such as 512M or 2G, at least 100k")
    return count
