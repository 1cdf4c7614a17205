"""F1 as a stream: what its first bytes show, and how large the same model is as GLB at equal quality."""

import tempfile
from pathlib import Path
from typing import Literal

import numpy as np

import upholster
from benchmarks.measure import EXEMPLAR, Results, median_seconds, one_pixel_a_texel
from upholster.export import PagedMesh, write_glb
from upholster.image import encode_image
from upholster.levels import refine_steps, texels_psnr
from upholster.options import WriteOptions
from upholster.quilt import Texels
from upholster.stream import Description, StreamDecoder, describe, encode_stream
from upholster.stream.prefix import Limit, feed_until
from upholster.textured import TexturedModel
from upholster.types import PixelArray

__all__ = ["stream"]


def stream(results: Results) -> None:
    """Measure F1's stream: bytes of each stage, size against GLB, time to refine."""
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, seed=7, method="paper")
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    first = StreamDecoder()
    feed_until(first, data, Limit(most_bytes=1))
    results.add("F1 stream, 9/7: whole", len(data) / 1000, "kB")
    results.add("F1 stream, 9/7: first textured view", first.received, "bytes", aim="at most 1000")
    decoder, place = StreamDecoder(), 0
    while not decoder.placements_complete:
        decoder.feed(data[place : place + 16])
        place += 16
    known, _ = decoder.placements_known
    results.add("F1 stream, 9/7: all placements are there", place / 1000, "kB")
    sizes = _sizes(describe(data))
    results.add("F1 stream, 9/7: bytes a source", sizes["P"] / known, "bytes", aim="about 1")
    cells = sum(layer.labels.size for layers in quilt.labels for layer in layers)
    results.add("F1 stream, 9/7: bits a label", 8 * sizes.get("M", 0) / cells, "bits")
    share = refine_steps(data, [Limit(coefficients=0.15)])[0]
    results.add(
        "F1 stream, 9/7: placements and 15 % of the coefficients",
        share.length / 1000,
        "kB",
        aim="within 16",
        remark=f"{share.psnr:.1f} dB",
    )
    low, high = share.length // 2, len(data)
    while low < high:
        middle = (low + high) // 2
        if _quality(data, middle, texels) >= 40:
            high = middle
        else:
            low = middle + 1
    results.add("F1 stream, 9/7: 40 dB against the full texels", high / 1000, "kB", aim="within 24")
    for quality in (35.0, 40.0):
        for name in ("webp", "jpeg"):
            _against_glb(results, name, quality, data, surface, texels)
    results.add(
        "F1 stream, 9/7: refine to 15 % in memory",
        1000 * median_seconds(lambda: _refine(data), runs=5),
        "ms",
        aim="at most 100",
    )
    exact = encode_stream(surface, quilt, exemplar, wavelet="haar", sample_quality="lossless")
    _paper_profile(results, exact, texels)
    _quilt_stream(results, exemplar, surface)


def _paper_profile(results: Results, data: bytes, texels: Texels) -> None:
    # The same in the paper's profile: the largest Haar coefficients first.
    what = "F1 stream, the paper's profile"
    results.add(f"{what}: whole", len(data) / 1000, "kB", remark="lossless")
    for share in (0.07, 0.15):
        step = refine_steps(data, [Limit(coefficients=share)])[0]
        name = f"{what}: placements and {100 * share:.0f} % of the coefficients"
        results.add(name, step.length / 1000, "kB", remark=f"{step.psnr:.1f} dB")
    results.add(f"{what}: 40 dB against the full texels", _bytes_for(data, texels, 40) / 1000, "kB")


def _quilt_stream(results: Results, exemplar: PixelArray, surface: upholster.Surface) -> None:
    # The same model by method "quilt": what a placement costs, part by part.
    quilt = upholster.synthesize(exemplar, surface, seed=7, **one_pixel_a_texel(surface, exemplar, 2**22))
    texels = upholster.paint(quilt, exemplar)
    data = encode_stream(surface, quilt, exemplar)
    told = describe(data)
    results.add("F1 quilt stream: whole", len(data) / 1000, "kB")
    results.add("F1 quilt stream: first textured view", told.view, "bytes", aim="at most 1000")
    sizes = _sizes(told)
    count = len(quilt.placements)
    for tag, name in (("N", "warp fields"), ("Q", "cells"), ("P", "placements"), ("M", "labels")):
        results.add(f"F1 quilt stream: {name}, a placement", sizes.get(tag, 0) / count, "bytes")
    whole = sum(sizes.get(tag, 0) for tag in "FNQPM") / count
    results.add(
        "F1 quilt stream: all of a placement",
        whole,
        "bytes",
        aim="at most 5, goal 4",
        remark=f"{count} placements on {len(quilt.charts)} charts",
    )
    results.add(
        "F1 quilt stream: 40 dB against the full texels",
        _bytes_for(data, texels, 40) / 1000,
        "kB",
        aim="within 50",
    )
    results.add(
        "F1 quilt stream: decode the placements",
        1000 * median_seconds(lambda: _refine(data), runs=3),
        "ms",
        remark="and 15 % of the coefficients, painted",
    )


def _sizes(told: Description) -> dict[str, int]:
    # Bytes of all chunks of each kind.
    return {tag: sum(row.length for row in told.chunks if row.tag == tag) for tag in {*"SLXDFQNPM"}}


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


def _refine(data: bytes) -> Texels:
    decoder = StreamDecoder()
    feed_until(decoder, data, Limit(coefficients=0.15))
    return decoder.texels()


def _quality(data: bytes, length: int, texels: Texels) -> float:
    decoder = StreamDecoder()
    decoder.feed(data[:length])
    return texels_psnr(decoder.texels(), texels)


def _against_glb(
    results: Results,
    name: Literal["png", "jpeg", "webp"],
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
        if _atlas_psnr(atlas, name, middle) >= wanted:
            high = middle
        else:
            low = middle + 1
    reached = min(wanted, _atlas_psnr(atlas, name, high))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "ring.glb"
        write_glb(path, PagedMesh(model.mesh, model.uv, atlas), texture=name, quality=high)
        size = path.stat().st_size
    short, long = 64, len(data)
    while short < long:
        middle = (short + long) // 2
        if _quality(data, middle, texels) >= reached:
            long = middle
        else:
            short = middle + 1
    results.add(
        f"F1 against GLB with {name} texture at {reached:.1f} dB",
        size / long,
        "times smaller",
        aim="at least 40",
        remark=f"{size / 1000:.0f} kB (quality {high}, 5000 quads) against {long / 1000:.1f} kB",
    )


def _atlas_psnr(atlas: PixelArray, name: Literal["png", "jpeg", "webp"], quality: int) -> float:
    from upholster.image import read_image

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"atlas.{'jpg' if name == 'jpeg' else name}"
        path.write_bytes(encode_image(atlas, name, quality=quality))
        error = read_image(path).astype(float) - atlas
    return float(10 * np.log10(255**2 / max(1e-9, np.mean(error * error))))
