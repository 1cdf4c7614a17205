"""Small pictures of streams for the start page: made when first asked for, one at a time, and remembered."""

import asyncio
import textwrap
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from functools import partial

import anyio.to_thread
import numpy as np

from upholster.errors import UpholsterError
from upholster.geometry import MeshSurface
from upholster.image import encode_image, from_linear
from upholster.image.drawing import Drawing
from upholster.model import tessellate
from upholster.options import WriteOptions
from upholster.outputs import TexturedModel
from upholster.refining import received_exemplar
from upholster.render import render
from upholster.server.pages import THUMBNAIL_SIZE
from upholster.server.versions import Version
from upholster.stream import StreamDecoder
from upholster.writing import painted

__all__ = ["Thumbnails", "draw_thumbnail"]

_MOST_REMEMBERED = 1 << 25
_PIECE = 1 << 16
_MOST_READ = 1 << 22
_MOST_TEXELS = 1 << 24
_MOST_SAMPLES = 1 << 25
_QUADS = 4000
_GROUND = 232  # about the grey of other pictures' background


class Thumbnails:
    """Makes thumbnails, and remembers 32 MiB of them."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, bytes] = OrderedDict()
        self._size = 0
        self._turn = asyncio.Lock()

    async def get(self, version: Version, *, gone: Callable[[], Awaitable[bool]]) -> bytes | None:
        """Return a PNG file's bytes; None if the client has gone before its turn.

        Parameters
        ----------
        version
            The stream.
        gone
            Tells whether no client waits for the answer any more.
        """
        async with self._turn:
            if version.tag in self._known:
                self._known.move_to_end(version.tag)
                return self._known[version.tag]
            if await gone():
                return None
            # The rest of the server goes on: kernels run without the interpreter's lock.
            picture = await anyio.to_thread.run_sync(partial(draw_thumbnail, version))
            if version.unchanged():
                self._remember(version.tag, picture)
            return picture

    def _remember(self, tag: str, picture: bytes) -> None:
        self._known[tag] = picture
        self._size += len(picture)
        while self._size > _MOST_REMEMBERED and len(self._known) > 1:
            self._size -= len(self._known.popitem(last=False)[1])


def draw_thumbnail(version: Version) -> bytes:
    """Return a picture of a stream as a PNG file's bytes; if it cannot be shown, one that says so.

    At most 4 MiB of the stream are read, or as far as its first view: any prefix is a picture. A model of
    more than 16 million texels is shown without its texture.
    """
    try:
        return _picture(version)
    except UpholsterError as error:
        return _placeholder("damaged stream", str(error))
    except Exception as error:
        # Too little memory, or a mistake of ours: the page shows its other streams all the same.
        return _placeholder("no preview", f"{type(error).__name__}: {error}")


def _picture(version: Version) -> bytes:
    decoder = StreamDecoder()
    while decoder.needed or decoder.received < _MOST_READ:
        piece = version.read(decoder.received, min(_PIECE, max(decoder.needed, _PIECE)))
        if not piece:
            break
        decoder.feed(piece)
    surface = decoder.surface
    if decoder.needed or surface is None:
        return _placeholder("cut stream", f"needs {decoder.needed:,} more bytes")
    height, width, channels = decoder.exemplar_shape
    texels = sum(chart.height * chart.width for chart in decoder.charts)
    if texels > _MOST_TEXELS or height * width * channels > _MOST_SAMPLES:
        if isinstance(surface, MeshSurface):
            return _placeholder("mesh", f"{len(surface.island):,} triangles")
        mesh = tessellate(surface, quads=_QUADS)
        linear = render(
            mesh.positions,
            mesh.normals,
            mesh.places,
            mesh.all_triangles(),
            None,
            size=THUMBNAIL_SIZE,
            threads=1,
        )
    else:
        options = WriteOptions(quads=_QUADS, size=THUMBNAIL_SIZE)
        base, maps = painted(decoder.quilt(), received_exemplar(decoder), threads=1)
        linear = TexturedModel(surface, base, options, threads=1, maps=maps).picture()
    return encode_image(from_linear(linear, "uint8"), "png")


def _placeholder(title: str, reason: str) -> bytes:
    width, height = THUMBNAIL_SIZE
    drawing = Drawing(width, height)
    drawing.paste(0, 0, np.full((height, width, 3), _GROUND, np.uint8))
    drawing.text(width // 2, height // 2 - 24, title, size=24, color=(0.6, 0.2, 0.1))
    for n, line in enumerate(textwrap.wrap(reason, 50, max_lines=4, placeholder=" ...")):
        drawing.text(width // 2, height // 2 + 8 + 20 * n, line, size=14)
    return encode_image(drawing.pixels(), "png")
