"""F1 as a stream: what its first bytes show, and how large the same model is as GLB at equal quality."""

import tempfile
from pathlib import Path

import numpy as np

import upholster
from benchmarks.measure import EXEMPLAR, Results, one_pixel_a_texel
from upholster.export import PagedMesh, write_glb
from upholster.image import encode_image
from upholster.levels import texels_psnr
from upholster.options import WriteOptions
from upholster.quilt import Texels
from upholster.stream import StreamDecoder, describe, encode_stream
from upholster.textured import TexturedModel
from upholster.types import PixelArray

__all__ = ["stream"]


PAPER = "method paper, 4.2 Mtexels"
QUILT = "method quilt, 4.2 Mtexels"


def stream(results: Results) -> None:
    """Measure F1 (128² RGB, the paper's cyclide) as a stream by both methods, and as GLB."""
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    _quilt_stream(results, exemplar, surface)
    quilt = upholster.synthesize(exemplar, surface, seed=7, method="paper")
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    results.add(f"{PAPER}: complete stream", len(data) / 1000, "kB")
    results.add(f"{PAPER}: first view", describe(data).view, "bytes", aim="at most 1000")
    decoder, place = StreamDecoder(), 0
    while not decoder.placements_complete:
        decoder.feed(data[place : place + 16])
        place += 16
    results.add(f"{PAPER}: all placements", place / 1000, "kB")
    results.add(
        f"{PAPER}: 40 dB against its texels", _bytes_for(data, texels, 40) / 1000, "kB", aim="within 24"
    )
    for quality in (35.0, 40.0):
        _against_glb(results, quality, data, surface, texels)


def _quilt_stream(results: Results, exemplar: PixelArray, surface: upholster.Surface) -> None:
    # The same model by method "quilt", and what a placement costs.
    quilt = upholster.synthesize(exemplar, surface, seed=7, **one_pixel_a_texel(surface, exemplar, 2**22))
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    found = describe(data)
    results.add(f"{QUILT}: complete stream", len(data) / 1000, "kB")
    results.add(f"{QUILT}: first view", found.view, "bytes", aim="at most 1000")
    placed = sum(row.length for row in found.chunks if row.tag in {*"FNQPM"})
    count = len(quilt.placements)
    results.add(
        f"{QUILT}: a placement, with its labels and its part of the warp field",
        placed / count,
        "bytes",
        aim="at most 5, goal 4",
        remark=f"{count:,} placements on {len(quilt.charts)} charts",
    )
    least = _bytes_for(data, texels, 40)
    results.add(f"{QUILT}: 40 dB against its texels", least / 1000, "kB", aim="within 50")


def _bytes_for(data: bytes, texels: Texels, wanted: float) -> int:
    # The shortest prefix, to 64 bytes, of that quality.
    low, high = 64, len(data)
    while high - low > 64:
        middle = (low + high) // 2
        if _quality(data, middle, texels) >= wanted:
            high = middle
        else:
            low = middle
    return high


def _quality(data: bytes, length: int, texels: Texels) -> float:
    decoder = StreamDecoder()
    decoder.feed(data[:length])
    return texels_psnr(decoder.texels(), texels)


def _against_glb(
    results: Results,
    wanted: float,
    data: bytes,
    surface: upholster.Surface,
    texels: Texels,
) -> None:
    # The GLB whose texture has the wanted dB, or its best below that, against the stream's prefix of the same
    # quality.
    model = TexturedModel(surface, texels, WriteOptions(quads=5000))
    atlas = model.atlas.pixels
    low, high = 1, 100
    while low < high:
        middle = (low + high) // 2
        if _atlas_psnr(atlas, middle) >= wanted:
            high = middle
        else:
            low = middle + 1
    reached = min(wanted, _atlas_psnr(atlas, high))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ring.glb"
        write_glb(path, PagedMesh(model.mesh, model.uv, atlas), texture="webp", quality=high)
        size = path.stat().st_size
    short, long = 64, len(data)
    while short < long:
        middle = (short + long) // 2
        if _quality(data, middle, texels) >= reached:
            long = middle
        else:
            short = middle + 1
    results.add(
        f"method paper as GLB with WebP at {reached:.1f} dB",
        size / 1000,
        "kB",
        remark=f"{size / long:.0f} times the stream's {long / 1000:.1f} kB of the same quality",
    )


def _atlas_psnr(atlas: PixelArray, quality: int) -> float:
    from upholster.image import read_image

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "atlas.webp"
        path.write_bytes(encode_image(atlas, "webp", quality=quality))
        error = read_image(path).astype(float) - atlas
    return float(10 * np.log10(255**2 / max(1e-9, np.mean(error * error))))
