"""The two profiles of a stream side by side: 9/7, the default, and Haar, the paper's.

``python -m benchmarks profiles [FOLDER]`` prints tables in Markdown: PSNR and sliced Wasserstein distance at
3, 5, 7 and 15 % of the coefficients and of the whole stream, per exemplar of 128². Means follow, with bytes,
beside the paper's rule itself (`upholster.methods.paper.keep_coefficients`); and where the default lies below
that rule on the project's grey brick, part by part.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import upholster
from benchmarks.fidelity import EXAMPLES, exemplars
from benchmarks.measure import Results
from upholster.codec import ImageDecoder, ImageHeader, encode_parts
from upholster.codec.color_transforms import fit_klt, unmix
from upholster.codec.thresholds import SHARES
from upholster.measure.fidelity import sliced_wasserstein
from upholster.methods.paper import keep_coefficients
from upholster.types import FloatArray, PixelArray
from upholster.wavelet import level_shape
from upholster.wavelet.lifting import Wavelet, band_norms, forward, inverse

__all__ = ["profiles"]

LEVELS = 5
"""Levels of 9/7 that an image of 128² gets by default."""

PROFILES: tuple[Wavelet, ...] = ("9/7", "haar")


@dataclass(frozen=True)
class Point:
    """An image decoded as far as a share of its coefficients."""

    length: int
    image: PixelArray
    psnr: float
    swd: float


def profiles(results: Results, *, folder: Path | None = None) -> None:
    """Compare both profiles over the exemplars of a folder; print tables and add their means."""
    found = {name: sample.exemplar for name, sample in exemplars([folder or EXAMPLES]).items()}
    points = {
        name: {wavelet: _points(image, wavelet) for wavelet in PROFILES} for name, image in found.items()
    }
    titles = [*(f"{100 * share:.0f} %" for share in SHARES), "complete"]
    for title, of in (("PSNR in dB", _psnr_text), ("Sliced Wasserstein distance, 10⁻³", _swd_text)):
        print(f"\n{title}: 9/7 · Haar\n\n| exemplar | {' | '.join(titles)} |\n|{' --- |' * 6}")
        for name, by in points.items():
            pairs = zip(by["9/7"], by["haar"], strict=True)
            print(f"| {name} | {' | '.join(f'{of(a)} · {of(b)}' for a, b in pairs)} |")
    _means(results, found, points)
    _why(results, upholster.read_exemplar(EXAMPLES / "brick.png", resize=128), 0.15)


def _means(
    results: Results, found: dict[str, PixelArray], points: dict[str, dict[Wavelet, list[Point]]]
) -> None:
    for n, share in enumerate(SHARES):
        rule, same = [], []
        for name, image in found.items():
            rule.append(psnr(image, keep_coefficients(image, coefficients=share)))
            same.append(_at_length(image, points[name]["haar"][n].length))
        for wavelet in PROFILES:
            mine = [by[wavelet][n] for by in points.values()]
            remark = f"the paper's rule {np.mean(rule):.2f}" if wavelet == "haar" else (
                f"{np.mean(same):.2f} at the bytes of Haar"
            )  # fmt: skip
            results.add(
                f"{100 * share:.0f} % of the coefficients, {wavelet}",
                float(np.mean([point.psnr for point in mine])),
                "dB",
                remark=f"{np.mean([point.length for point in mine]):.0f} bytes; distance "
                f"{1000 * np.mean([point.swd for point in mine]):.2f}e-3; {remark}",
            )
    for wavelet in PROFILES:
        whole = [by[wavelet][-1] for by in points.values()]
        exact = "lossless" if all(np.isinf(point.psnr) for point in whole) else ""
        results.add(f"complete, {wavelet}", float(np.mean([p.length for p in whole])), "bytes", remark=exact)


def _why(results: Results, image: PixelArray, share: float) -> None:
    # Where the default lies below the paper's rule: what its passes keep, its wavelet; and what bytes say.
    count = max(1, round(share * image.size))
    nine, haar = (_decoded(image, wavelet, count) for wavelet in PROFILES)
    what = f"brick, {100 * share:.0f} %"
    rows = (
        ("9/7, as the stream has it", psnr(image, nine[1]), f"{nine[0]} bytes"),
        ("9/7, its largest coefficients, in full", psnr(image, _largest(image, count)), "no stream"),
        ("Haar, its largest, in full: the paper's rule",
         psnr(image, keep_coefficients(image, coefficients=share)), "no stream"),
        ("Haar, as the stream has it", psnr(image, haar[1]), f"{haar[0]} bytes"),
        ("9/7, at the bytes of Haar", _at_length(image, haar[0]), f"{haar[0]} bytes"),
    )  # fmt: skip
    for name, quality, remark in rows:
        results.add(f"{what}: {name}", quality, "dB", remark=remark)


def _points(image: PixelArray, wavelet: Wavelet) -> list[Point]:
    counts = [*(max(1, round(share * image.size)) for share in SHARES), image.size]
    points = []
    for count in counts:
        length, decoded = _decoded(image, wavelet, count)
        distance = float(np.mean(sliced_wasserstein([decoded], image)))
        points.append(Point(length, decoded, psnr(image, decoded), distance))
    return points


def _decoded(image: PixelArray, wavelet: Wavelet, count: int) -> tuple[int, PixelArray]:
    coded = encode_parts(image, wavelet=wavelet)
    header, payload = coded.header, coded.payload
    decoder = ImageDecoder(ImageHeader.parse(header))
    while decoder.significant < count and decoder.received < len(payload):
        size = max(1, (count - decoder.significant) // 64)
        decoder.feed(payload[decoder.received : decoder.received + size])
    return len(header) + decoder.received, decoder.image()


def _at_length(image: PixelArray, length: int) -> float:
    coded = encode_parts(image)
    decoder = ImageDecoder(ImageHeader.parse(coded.header))
    decoder.feed(coded.payload[: length - len(coded.header)])
    return psnr(image, decoder.image())


def _largest(image: PixelArray, count: int) -> FloatArray:
    # An image of so many of its 9/7 coefficients, those that count most, none of them rounded.
    means = image.mean(axis=(0, 1))
    planes = image - means
    matrix = fit_klt(planes) if image.shape[2] == 3 else None
    if matrix is not None:
        planes = np.linalg.solve(matrix / 16384.0, planes.reshape(-1, 3).T).T.reshape(image.shape)
    found = forward(planes, wavelet="9/7", levels=LEVELS)
    weights = np.ones(image.shape)
    for level in range(1, LEVELS + 1):
        (rows, columns), (high, wide) = (level_shape(image.shape, n) for n in (level, level - 1))
        low, mixed, _, corner = band_norms("9/7", level)
        weights[:high, :wide] = mixed
        weights[rows:high, columns:wide] = corner
        weights[:rows, :columns] = low
    least = np.sort(np.abs(found * weights), axis=None)[-count]
    kept = inverse(np.where(np.abs(found * weights) >= least, found, 0.0), wavelet="9/7", levels=LEVELS)
    mixed_back: FloatArray = kept if matrix is None else unmix(kept, matrix)
    rounded: FloatArray = np.clip(np.floor(mixed_back + means + 0.5), 0, 255)
    return rounded


def psnr(image: PixelArray, other: PixelArray | FloatArray) -> float:
    """Return the peak signal-to-noise ratio of 8-bit images in dB; infinite where they are equal."""
    error = float(np.mean((image.astype(np.float64) - other) ** 2))
    return float("inf") if error == 0 else 10 * float(np.log10(255**2 / error))


def _psnr_text(point: Point) -> str:
    return "equal" if np.isinf(point.psnr) else f"{point.psnr:.1f}"


def _swd_text(point: Point) -> str:
    return f"{1000 * point.swd:.1f}"
