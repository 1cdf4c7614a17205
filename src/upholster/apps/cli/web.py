"""``upholster web``: the scripts that show streams, for any web server."""

from typing import Annotated

import typer

from upholster.apps.cli.console import say

__all__ = ["web"]


def web(
    folder: Annotated[str, typer.Argument(help="The folder; it is made if it is missing.", metavar="FOLDER")],
    streams: Annotated[
        list[str] | None,
        typer.Argument(help="Streams to copy there, which the page shows.", metavar="FILE.uph"),
    ] = None,
) -> None:
    """Write what a web page needs to show streams: the scripts, their types, streams, and an index.html."""
    from upholster.output.web_folder import write_web_folder

    written = write_web_folder(folder, streams or [])
    kept = "" if "index.html" in written else "; index.html stays as it was"
    say(f"wrote {len(written)} files to {folder}{kept}; to look at it: python -m http.server -d {folder}")
