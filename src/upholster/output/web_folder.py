"""A folder for a web server: the scripts that show streams, streams, and a page to begin with."""

import os
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path
from urllib.parse import quote

from upholster.base.errors import FormatError, InputError
from upholster.base.files import outputs, path_text, read_bytes, write_bytes
from upholster.codec.stream.chunks import ChunkReader

__all__ = ["write_web_folder"]

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
  body {{ margin: 0 }}
  upholster-viewer {{ display: block; height: 100vh }}
</style>
<script type="module" src="upholster-viewer.js"></script>
</head>
<body>
{viewers}
</body>
</html>
"""

_VIEWER = '<upholster-viewer src="{address}" alt="{name}"></upholster-viewer>'

_NAME = "model.uph"
"""The stream that the page shows if none is given."""


def write_web_folder(
    folder: str | os.PathLike[str], streams: Sequence[str | os.PathLike[str]] = ()
) -> list[str]:
    """Write all that a page needs to show streams into a folder.

    Parameters
    ----------
    folder
        The folder, which is made if it is missing. Scripts in it are replaced; an ``index.html`` stays.
    streams
        Complete streams, which are copied unless they are in the folder already. The page shows them all.

    Returns
    -------
    list of str
        Names of the files written: scripts and their types, streams, and ``index.html`` if there was none.

    Raises
    ------
    InputError, FormatError
        If a stream is missing, cut or damaged, two have one name, or the folder cannot be made or written to.
    """
    place = Path(path_text(folder, "folder"))
    shipped = resources.files("upholster.output") / "web"
    files = {entry.name: entry.read_bytes() for entry in shipped.iterdir()}
    names: list[str] = []
    for stream in streams:
        name, data = os.path.basename(path_text(stream, "stream")), read_bytes(stream)
        _check_complete(name, data)
        if name in names or name in files:
            raise InputError(
                f"stream {name!r} has the name of another file; allowed: streams of different names"
            )
        names.append(name)
        if Path(stream).resolve().parent != place.resolve():
            files[name] = data
    if not (place / "index.html").exists():
        files["index.html"] = _page(names or [_NAME]).encode()
    try:
        place.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"folder {os.fspath(place)!r} cannot be made: {error.strerror}") from None
    with outputs([place / name for name in files], inputs=streams) as written:
        for name, data in files.items():
            write_bytes(written.path(place / name), data)
    return list(files)


def _check_complete(name: str, data: bytes) -> None:
    reader = ChunkReader()
    try:
        list(reader.feed(data))
    except FormatError as error:
        raise FormatError(f"{name}: {error}") from None
    if not reader.complete:
        raise FormatError(f"{name}: byte {len(data)}: file is cut; allowed: a complete stream")


def _page(names: Sequence[str]) -> str:
    """Return a page that shows streams next to it, each as high as the window."""
    titles = [escape(name.removesuffix(".uph")) for name in names]
    pairs = zip(names, titles, strict=True)
    viewers = [_VIEWER.format(address=escape(quote(name)), name=title) for name, title in pairs]
    return _PAGE.format(title=", ".join(titles), viewers="\n".join(viewers))
