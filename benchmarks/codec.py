"""The image codec against others: rate and distortion, small textures, lossless, cut files, speed.

``python -m benchmarks codec``; with another folder of colour textures ``python -m benchmarks.codec FOLDER``.
Peers are compared at their own number of bytes, headers included: our stream is cut there.
"""

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pywt
from numpy.typing import NDArray
from PIL import Image
from skimage import data

from benchmarks.codec_peers import LOSSLESS, PEERS, cut_decoders, psnr
from benchmarks.measure import Results, median_seconds
from upholster.codec import ImageDecoder, ImageHeader, encode_parts
from upholster.wavelet.lifting import Wavelet, forward, inverse

__all__ = ["codec"]

HERE = Path(__file__).parent
RATES = (1.0, 0.5, 0.25, 0.125, 0.0625)
BUDGETS = (1024, 2048, 4096, 8192, 16384)
CUTS = 200
WAVELETS: dict[Wavelet, str] = {"9/7": "bior4.4", "5/3": "bior2.2", "haar": "haar"}

Pixels = NDArray[np.uint8]


def codec(results: Results, *, folder: Path | None = None) -> None:
    """Run all parts; write codec.csv next to this file."""
    found = Results()
    textures = _textures(HERE.parent / "examples" if folder is None else folder)
    _grey(found)
    for side in (128, 256):
        _colour(found, [image[:side, :side] for image in textures], side)
        _lossless(found, [image[:side, :side] for image in textures], f"{side}² RGB")
    _lossless(found, list(_greys().values()), "512² grey")
    _cuts(found)
    _speed(found, textures[0][:128, :128])
    found.write(HERE / "codec.csv")
    results.rows += found.rows


def _greys() -> dict[str, Pixels]:
    # scikit-image's pictures that are free to use, 512² each.
    def grey(image: Pixels, left: int = 0, side: int = 512) -> Pixels:
        cut = Image.fromarray(image).convert("L").crop((left, 0, left + side, side))
        return np.asarray(cut.resize((512, 512), Image.Resampling.LANCZOS))

    return {
        "camera": data.camera(),
        "astronaut": grey(data.astronaut()),
        "brick": data.brick(),
        "grass": data.grass(),
        "gravel": data.gravel(),
        "coffee": grey(data.coffee(), 50, 400),
        "chelsea": grey(data.chelsea(), 75, 300),
    }


def _textures(folder: Path) -> list[Pixels]:
    # The middle square of every colour image, reduced to 256².
    out = []
    for path in sorted(folder.glob("*.png")):
        with Image.open(path) as image:
            if image.mode not in ("RGB", "RGBA", "P"):
                continue
            side = min(image.size)
            left, top = (image.width - side) // 2, (image.height - side) // 2
            square = image.convert("RGB").crop((left, top, left + side, top + side))
        out.append(np.asarray(square.resize((256, 256), Image.Resampling.LANCZOS)))
    if not out:
        raise SystemExit(f"{folder} holds no colour PNG")
    return out


def _encoded(image: Pixels, **options: Any) -> bytes:
    coded = encode_parts(np.atleast_3d(image), **options)
    return coded.header + coded.payload


def _decoded(stream: bytes) -> Pixels:
    header = ImageHeader.parse(stream)
    decoder = ImageDecoder(header)
    decoder.feed(stream[header.length :])
    return np.asarray(decoder.image())


def _grey(results: Results) -> None:
    gains = []
    for name, image in _greys().items():
        stream = _encoded(image, most_bytes=image.size // 8)
        for rate in RATES:
            rows = []
            for peer, reference in PEERS["JPEG 2000"](image, int(image.size * rate / 8)):
                ours = psnr(image, _decoded(stream[: len(peer)]))
                rows.append((ours - psnr(image, reference), ours, len(peer)))
            gain, ours, size = min(rows)
            gains.append(gain)
            results.add(
                f"grey {name}, {rate} bpp",
                ours,
                "dB",
                remark=f"{size} bytes; {gain:+.2f} against OpenJPEG 9/7",
            )
    results.add("grey: mean over OpenJPEG", float(np.mean(gains)), "dB", aim="at least 0.25, better 0.40")
    results.add("grey: worst over OpenJPEG", min(gains), "dB", aim="at least -0.25")


def _colour(results: Results, images: list[Pixels], side: int) -> None:
    streams = [_encoded(image, most_bytes=BUDGETS[-1]) for image in images]
    for name, peer in PEERS.items():
        means = []
        for budget in BUDGETS:
            gains, ratios = [], []
            for image, stream in zip(images, streams, strict=True):
                rows = []
                for coded, reference in peer(image, budget):
                    ours = _decoded(stream[: len(coded)])
                    distances = [sliced_wasserstein(image, other) for other in (ours, reference)]
                    gain = psnr(image, ours) - psnr(image, reference)
                    rows.append((gain, distances[0] / max(distances[1], 1e-9)))
                if rows:
                    gain, ratio = min(rows)
                    gains.append(gain)
                    ratios.append(ratio)
            if not gains:
                continue
            means.append(float(np.mean(gains)))
            results.add(
                f"{side}² RGB, {budget // 1024} kB: mean over {name}",
                means[-1],
                "dB",
                aim="at least 0.6" if name == "JPEG 2000" else "",  # at every size, not only on average
                remark=f"{len(gains)} images, worst {min(gains):+.2f}; texture distance "
                f"{np.exp(np.mean(np.log(ratios))):.2f} of its",
            )
        results.add(f"{side}² RGB, all sizes: mean over {name}", float(np.mean(means)), "dB")


def sliced_wasserstein(image: Pixels, other: Pixels) -> float:
    """Return how differently 7×7 patches are distributed in two RGB images, in sample steps.

    The mean over 48 fixed random directions of the distance between the sorted projections of all patches
    (every second row and column): it does not ask where a patch is, as a texture's viewer does not.
    """
    directions = np.random.default_rng(1).normal(size=(147, 48)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=0)
    windows = [
        np.lib.stride_tricks.sliding_window_view(pixels.astype(np.float32), (7, 7), (0, 1))[::2, ::2]
        for pixels in (image, other)
    ]
    one, two = (np.sort(window.reshape(-1, 147) @ directions, axis=0) for window in windows)
    return float(np.abs(one - two).mean())


def _lossless(results: Results, images: list[Pixels], what: str) -> None:
    ours = []
    for image in images:
        stream = _encoded(image, sample_quality="lossless")
        if not np.array_equal(_decoded(stream), np.atleast_3d(image)):
            raise SystemExit(f"{what}: lossless is not")
        ours.append(len(stream))
    for name, encode in LOSSLESS.items():
        shares = [size / len(encode(image)) for size, image in zip(ours, images, strict=True)]
        aim = "at most 0.96" if name == "JPEG 2000" else ""
        results.add(f"lossless {what}: mean share of {name}'s bytes", float(np.mean(shares)), "", aim=aim)


def _cuts(results: Results) -> None:
    image = np.asarray(Image.fromarray(data.astronaut()).crop((96, 0, 352, 256)))
    most = 24576
    decoders: dict[str, tuple[bytes, Callable[[bytes], Pixels | None]]] = {
        "upholster": (_encoded(image, most_bytes=most), _decoded),
        **cut_decoders(image, most),
    }
    rng = np.random.default_rng(7)
    for name, (stream, decode) in decoders.items():
        lengths = np.unique(np.append(rng.integers(400, len(stream), CUTS), len(stream)))
        kept, values = [], []
        for length in lengths:
            decoded = decode(stream[:length])
            if decoded is not None and decoded.size == image.size:
                kept.append(length)
                values.append(psnr(image, decoded))
        falls = np.maximum.accumulate(values) - values
        half = (
            f"{np.interp(len(stream) / 2, kept, values):.1f} dB at half of the file, "
            if len(kept) > 1
            else ""
        )
        results.add(
            f"256² RGB cut at {len(lengths)} places, {name}: largest fall",
            float(falls.max()),
            "dB",
            aim="at most 0.05" if name == "upholster" else "",
            remark=f"{len(kept)} decode; {half}{values[-1]:.1f} dB at the end",
        )


def _speed(results: Results, texture: Pixels) -> None:
    camera = data.camera()
    for what, image, size, aims in (
        ("512² grey, 1 bpp", camera, 32768, (150, 120)),
        ("512² grey, 0.25 bpp", camera, 8192, (75, 60)),
        ("128² RGB, 4 kB", texture, 4096, (None, 30)),
    ):
        stream = _encoded(image, most_bytes=size)
        for verb, call, aim in (
            ("encode", lambda image=image, size=size: _encoded(image, most_bytes=size), aims[0]),
            ("decode", lambda stream=stream: _decoded(stream), aims[1]),
        ):
            results.add(
                f"{what}: {verb}",
                1000 * median_seconds(call, runs=11),
                "ms",
                aim=f"at most {aim}" if aim else "",
            )
    for wavelet, theirs in WAVELETS.items():
        _lifting_speed(results, camera, wavelet, theirs)


def _lifting_speed(results: Results, image: Pixels, wavelet: Wavelet, theirs: str) -> None:
    ours_in, theirs_in = image.astype(np.int32 if wavelet == "5/3" else np.float64), image.astype(np.float64)
    coefficients = forward(ours_in, wavelet=wavelet, levels=6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyWavelets warns that six levels reach beyond the border
        decomposed = pywt.wavedec2(theirs_in, theirs, level=6)
        calls: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
            "forward": (
                lambda: forward(ours_in, wavelet=wavelet, levels=6),
                lambda: pywt.wavedec2(theirs_in, theirs, level=6),
            ),
            "inverse": (
                lambda: inverse(coefficients, wavelet=wavelet, levels=6),
                lambda: pywt.waverec2(decomposed, theirs),
            ),
        }
        for verb, (ours, peer) in calls.items():
            mine, other = median_seconds(ours, runs=31), median_seconds(peer, runs=31)
            results.add(
                f"lifting {wavelet}, {verb}, 512², 6 levels",
                1000 * mine,
                "ms",
                aim="a fifth of PyWavelets'",
                remark=f"PyWavelets {1000 * other:.2f} ms: {other / mine:.1f} times",
            )


if __name__ == "__main__":
    results = Results()
    codec(results, folder=Path(sys.argv[1]) if sys.argv[1:] else None)
    results.show()
