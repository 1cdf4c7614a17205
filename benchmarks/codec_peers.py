"""Other image coders, through imagecodecs and Pillow: within so many bytes, and without loss."""

import io
from collections.abc import Callable
from typing import Any

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from PIL import Image

__all__ = ["LOSSLESS", "PEERS"]

Pixels = NDArray[np.uint8]
Coded = tuple[bytes, Pixels]

_OPENJPEG = {"quality_mode": "rates", "irreversible": True, "no_jp2": True, "progression": "LRCP", "mct": 1}


def _largest_within(
    most_bytes: int, low: float, high: float, encode: Callable[[float], bytes]
) -> bytes | None:
    # The best quality, from `low` to `high`, whose bytes are few enough.
    best = None
    for _ in range(12):
        middle = (low + high) / 2
        data = encode(middle)
        if len(data) <= most_bytes:
            best, low = data, middle
        else:
            high = middle
    return best


def _decoded(data: bytes | None, decode: Callable[[bytes], Any]) -> list[Coded]:
    return [] if data is None else [(data, np.asarray(decode(data)))]


def _pillow(image: Pixels, kind: str, **options: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(image).save(file, kind, **options)
    return file.getvalue()


def _jpeg2000(image: Pixels, most_bytes: int) -> list[Coded]:
    # OpenJPEG's two ways of rate control, bare codestreams: by PSNR and by ratio. Whichever is better counts.
    def by_psnr(level: float) -> bytes:
        # Its type hint says int, but the level is a PSNR, and fractions count.
        options: dict[str, Any] = {"level": level, "codecformat": "J2K", "reversible": False}
        return bytes(imagecodecs.jpeg2k_encode(image, **options))

    def by_ratio(share: float) -> bytes:
        ratio = image.size / (share * most_bytes)
        return _pillow(image, "JPEG2000", quality_layers=[ratio], **_OPENJPEG)

    return [
        *_decoded(_largest_within(most_bytes, 5, 70, by_psnr), imagecodecs.jpeg2k_decode),
        *_decoded(_largest_within(most_bytes, 0.5, 1.2, by_ratio), imagecodecs.jpeg2k_decode),
    ]


def _webp(image: Pixels, most_bytes: int) -> list[Coded]:
    def encode(quality: float) -> bytes:
        return bytes(imagecodecs.webp_encode(image, level=quality, method=6, lossless=False))

    return _decoded(_largest_within(most_bytes, 0, 100, encode), imagecodecs.webp_decode)


def _avif(image: Pixels, most_bytes: int) -> list[Coded]:
    def encode(quality: float) -> bytes:
        return bytes(imagecodecs.avif_encode(image, level=round(quality), speed=4, pixelformat="444"))

    return _decoded(_largest_within(most_bytes, 0, 99, encode), imagecodecs.avif_decode)


def _jpeg_xl(image: Pixels, most_bytes: int) -> list[Coded]:
    def encode(quality: float) -> bytes:
        distance = 25 * 0.002**quality
        return bytes(imagecodecs.jpegxl_encode(image, distance=distance, effort=7))

    return _decoded(_largest_within(most_bytes, 0, 1, encode), imagecodecs.jpegxl_decode)


PEERS: dict[str, Callable[[Pixels, int], list[Coded]]] = {
    "JPEG 2000": _jpeg2000,
    "WebP": _webp,
    "AVIF": _avif,
    "JPEG XL": _jpeg_xl,
}
"""Name → function that codes (h, w, 3) or (h, w) within so many bytes: streams and what they decode to."""

LOSSLESS: dict[str, Callable[[Pixels], bytes]] = {
    "JPEG 2000": lambda image: bytes(
        imagecodecs.jpeg2k_encode(image, level=0, codecformat="J2K", reversible=True)
    ),
    "PNG": lambda image: _pillow(image, "PNG", optimize=True),
    "WebP": lambda image: bytes(
        imagecodecs.webp_encode(
            image if image.ndim == 3 else np.stack([image] * 3, axis=-1), level=100, method=6, lossless=True
        )
    ),
    "JPEG XL": lambda image: bytes(imagecodecs.jpegxl_encode(image, lossless=True, effort=7)),
}
"""Name → function that codes without loss."""
