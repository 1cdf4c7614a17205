"""Small pictures of streams for the start page, drawn in a process of its own, see `thumbnails`.

A stream may come from anyone. Limits of texels, samples and charts bound its demands before it is painted;
beyond them, this process has a limit of memory, and the server ends it after some time.
"""

import signal
import textwrap
from contextlib import suppress
from typing import BinaryIO

import numpy as np

from upholster.apps.server.html_pages import THUMBNAIL_SIZE
from upholster.base.display import number_of
from upholster.base.errors import FormatError, UpholsterError, printable
from upholster.base.limits import Limits
from upholster.base.options.write_options import WriteOptions
from upholster.charts.tessellation.mesh import tessellate
from upholster.codec.stream.reader import StreamDecoder
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.color import from_linear
from upholster.image.drawing import Drawing
from upholster.image.files.write import encode_image
from upholster.model.render.picture import render
from upholster.model.textured_model import TexturedModel
from upholster.output.output_writer import painted
from upholster.output.refinement import received_exemplar
from upholster.runtime.parallel import running

__all__ = ["draw_file", "draw_thumbnail", "placeholder"]

_MOST_MEMORY = 4 << 30
_PIECE = 1 << 16
_MOST_READ = 1 << 22
_PAINTED = Limits(texels=1 << 24, charts=4096)
_MOST_VIEW = 1 << 26
_QUADS = 4000
_GROUND = 232  # about the grey of other pictures' background


def draw_file(path: str) -> bytes:
    """Return `draw_thumbnail` of a file; for a process that does nothing else."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server
    _limit_memory()
    with open(path, "rb") as file:
        return draw_thumbnail(file)


def draw_thumbnail(file: BinaryIO) -> bytes:
    """Return a picture of a stream as a PNG file's bytes; if it cannot be shown, one that says so.

    At most 4 MiB of the stream are read, or up to its first view, if that is at most 64 MiB: every longer
    prefix is a picture. A model of more than 16 million texels or 4096 charts is shown without its texture.
    """
    try:
        with running(1):
            return _picture(file)
    except UpholsterError as error:
        return placeholder("damaged stream", str(error))


def _picture(file: BinaryIO) -> bytes:
    is_small = True
    try:
        decoder = _decoded(file, _PAINTED)
    except FormatError:
        decoder, is_small = _decoded(file, Limits()), False
    surface = decoder.surface
    if decoder.needed or surface is None:
        return placeholder("cut stream", f"needs {decoder.needed:,} more bytes")
    if not is_small:
        if isinstance(surface, MeshSurface):
            return placeholder("mesh", number_of(len(surface.island), "triangle"))
        mesh = tessellate(surface, quads=_QUADS)
        linear = render(
            mesh.positions,
            mesh.normals,
            mesh.places,
            mesh.all_triangles(),
            None,
            size=THUMBNAIL_SIZE,
        )
    else:
        options = WriteOptions(quads=_QUADS, size=THUMBNAIL_SIZE)
        base, maps = painted(decoder.quilt(), received_exemplar(decoder))
        linear = TexturedModel(surface, base, options, maps=maps).picture()
    return encode_image(from_linear(linear, "uint8"), "png")


def _decoded(file: BinaryIO, limits: Limits) -> StreamDecoder:
    decoder = StreamDecoder(limits=limits)
    file.seek(0)
    while decoder.received < (_MOST_VIEW if decoder.needed else _MOST_READ) and (piece := file.read(_PIECE)):
        decoder.feed(piece)
    return decoder


def placeholder(title: str, reason: str) -> bytes:
    """Return a picture that shows only text."""
    width, height = THUMBNAIL_SIZE
    drawing = Drawing(width, height)
    drawing.paste(0, 0, np.full((height, width, 3), _GROUND, np.uint8))
    drawing.text(width // 2, height // 2 - 24, title, size=24, color=(0.6, 0.2, 0.1))
    for n, line in enumerate(textwrap.wrap(printable(reason), 50, max_lines=4, placeholder=" ...")):
        drawing.text(width // 2, height // 2 + 8 + 20 * n, line, size=14)
    return encode_image(drawing.pixels(), "png")


def _limit_memory() -> None:
    """Limit this process's memory, if the system allows it: allocations fail before the machine is full."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_AS)
        least = _MOST_MEMORY if most == resource.RLIM_INFINITY else min(most, _MOST_MEMORY)
        resource.setrlimit(resource.RLIMIT_AS, (least, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
