"""F1 as a stream: what its first bytes show, and how large the same model is as GLB at equal quality."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import upholster
from benchmarks.measure import EXEMPLAR, Request, one_pixel_a_texel, psnr, row
from benchmarks.tables import Table
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray
from upholster.codec.stream.description import describe
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.writer import encode_stream
from upholster.image.files.read import read_image
from upholster.image.files.write import encode_image
from upholster.model.textured_model import TexturedModel
from upholster.output.export.glb import write_glb
from upholster.output.export.pages import PagedMesh
from upholster.output.levels import texels_psnr
from upholster.quilt.model import Texels

__all__ = ["measured"]

PAPER = "method paper, 4.2 Mtexels"
QUILT = "method quilt, 4.2 Mtexels"


def measured(_request: Request) -> Table:
    """Measure F1 (128² RGB, the paper's cyclide) as a stream by both methods, and as GLB."""
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, seed=7, method="paper")
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    decoder, place = StreamDecoder(), 0
    while not decoder.placements_complete:
        decoder.feed(data[place : place + 16])
        place += 16
    rows = [
        *_quilt_stream(exemplar, surface),
        row(f"{PAPER}: complete stream", len(data) / 1000, "kB"),
        row(f"{PAPER}: first view", describe(data).view, "bytes"),
        row(f"{PAPER}: all placements", place / 1000, "kB"),
        row(f"{PAPER}: 40 dB against its texels", _bytes_for(data, texels, 40) / 1000, "kB"),
    ]
    rows += [_against_glb(quality, data, surface, texels) for quality in (35.0, 40.0)]
    return Table(("what", "figure", "compared with"), rows)


def _quilt_stream(exemplar: PixelArray, surface: upholster.Surface) -> list[list[str]]:
    # The same model by method "quilt", and what a placement costs.
    quilt = upholster.synthesize(exemplar, surface, seed=7, **one_pixel_a_texel(surface, exemplar, 2**22))
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    found = describe(data)
    placed, count = (
        sum(chunk.length for chunk in found.chunks if chunk.tag in {*"FNQPM"}),
        len(quilt.placements),
    )
    each = f"{QUILT}: a placement, with its labels and its part of the warp field"
    return [
        row(f"{QUILT}: complete stream", len(data) / 1000, "kB"),
        row(f"{QUILT}: first view", found.view, "bytes"),
        row(each, placed / count, "bytes", f"{count:,} placements on {len(quilt.charts)} charts"),
        row(f"{QUILT}: 40 dB against its texels", _bytes_for(data, texels, 40) / 1000, "kB"),
    ]


def _least(low: int, high: int, reaches: Callable[[int], bool]) -> int:
    # The least number that reaches something, or the highest.
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if reaches(middle) else (middle + 1, high)
    return high


def _bytes_for(data: bytes, texels: Texels, wanted: float) -> int:
    def reaches(length: int) -> bool:
        decoder = StreamDecoder()
        decoder.feed(data[:length])
        return texels_psnr(decoder.texels(), texels) >= wanted

    return _least(64, len(data), reaches)


def _against_glb(wanted: float, data: bytes, surface: upholster.Surface, texels: Texels) -> list[str]:
    # The GLB whose texture has the wanted dB, or its best below that, against the stream's prefix of the same
    # quality.
    model = TexturedModel(surface, texels, WriteOptions(quads=5000))
    atlas = model.atlas.pixels
    with tempfile.TemporaryDirectory() as folder:
        webp, glb = Path(folder, "atlas.webp"), Path(folder, "ring.glb")

        def decibels(quality: int) -> float:
            webp.write_bytes(encode_image(atlas, "webp", quality=quality))
            return psnr(atlas, read_image(webp))

        quality = _least(1, 100, lambda quality: decibels(quality) >= wanted)
        reached = min(wanted, decibels(quality))
        write_glb(glb, PagedMesh(model.mesh, model.uv, atlas), texture="webp", quality=quality)
        size = glb.stat().st_size
    prefix = _bytes_for(data, texels, reached)
    remark = f"{size / prefix:.0f} times the stream's {prefix / 1000:.1f} kB of the same quality"
    return row(f"method paper as GLB with WebP at {reached:.1f} dB", size / 1000, "kB", remark)
