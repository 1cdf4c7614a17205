"""Other image coders, through imagecodecs and Pillow: within so many bytes, without loss, and cut."""

import io
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from shutil import which
from typing import Any

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile

__all__ = ["LOSSLESS", "PEERS", "cut_decoders", "psnr"]

Pixels = NDArray[np.uint8]
Coded = tuple[bytes, Pixels]

_OPENJPEG = {"quality_mode": "rates", "irreversible": True, "no_jp2": True, "progression": "LRCP", "mct": 1}


def psnr(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Return the peak signal-to-noise ratio of 8-bit samples in dB; 99 where they are equal."""
    error = np.mean((one.astype(np.float64) - other.reshape(one.shape)) ** 2)
    return 99.0 if error == 0 else float(10 * np.log10(255**2 / error))


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


def _open(data: bytes) -> Pixels:
    return np.asarray(Image.open(io.BytesIO(data)))


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


def _progressive_jpeg(image: Pixels, most_bytes: int) -> list[Coded]:
    def encode(quality: float) -> bytes:
        return _pillow(
            image, "JPEG", quality=round(quality), progressive=True, optimize=True, subsampling="4:2:0"
        )

    return _decoded(_largest_within(most_bytes, 1, 98, encode), _open)


PEERS: dict[str, Callable[[Pixels, int], list[Coded]]] = {
    "JPEG 2000": _jpeg2000,
    "WebP": _webp,
    "AVIF": _avif,
    "JPEG XL": _jpeg_xl,
    "progressive JPEG": _progressive_jpeg,
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


def cut_decoders(image: Pixels, most_bytes: int) -> dict[str, tuple[bytes, Callable[[bytes], Pixels | None]]]:
    """Return per peer that can decode cut files: a file within `most_bytes`, and what decodes its prefixes.

    OpenJPEG and JPEG XL need their own programs for that, which libraries' bindings don't reach: without
    `opj_decompress` or `djxl` on the path they are left out.
    """
    found: dict[str, tuple[bytes, Callable[[bytes], Pixels | None]]] = {}
    if which("opj_decompress"):
        plain = _jpeg2000(image, most_bytes)[0][0]
        sizes = np.geomspace(most_bytes / 64, most_bytes, 12)
        layers = _pillow(image, "JPEG2000", quality_layers=list(image.size / sizes), **_OPENJPEG)
        command = ["opj_decompress", "-allow-partial", "-i", "in.j2k", "-o", "out.png"]
        found["OpenJPEG"] = (plain, partial(_by_program, command))
        found["OpenJPEG, 12 layers"] = (layers, partial(_by_program, command))
    jpeg = _progressive_jpeg(image, most_bytes)[0][0]
    found["progressive JPEG"] = (jpeg, _cut_jpeg)
    if which("djxl") and which("cjxl"):
        # Pillow and imagecodecs don't ask for progressive coding; the program does.
        command = ["djxl", "--allow_partial_files", "in.jxl", "out.png"]
        found["JPEG XL"] = (_progressive_jpeg_xl(image, most_bytes), partial(_by_program, command))
    return found


def _by_program(command: list[str], data: bytes) -> Pixels | None:
    with tempfile.TemporaryDirectory() as folder:
        source = next(name for name in command if name.startswith("in."))
        (Path(folder) / source).write_bytes(data)
        subprocess.run(command, cwd=folder, capture_output=True, check=False)
        out = Path(folder) / "out.png"
        return _open(out.read_bytes()) if out.exists() else None


def _progressive_jpeg_xl(image: Pixels, most_bytes: int) -> bytes:
    def encode(quality: float) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            Image.fromarray(image).save(path / "in.png")
            subprocess.run(
                ["cjxl", "-p", "-d", f"{25 * 0.002**quality:.4f}", "in.png", "out.jxl"],
                cwd=path, check=True, capture_output=True,
            )  # fmt: skip
            return (path / "out.jxl").read_bytes()

    data = _largest_within(most_bytes, 0, 1, encode)
    if data is None:
        raise RuntimeError(f"cjxl does not reach {most_bytes} bytes")
    return data


def _cut_jpeg(data: bytes) -> Pixels | None:
    ImageFile.LOAD_TRUNCATED_IMAGES = True
    try:
        picture = _open(data)
        return None if picture.min() == picture.max() else picture  # cut within a marker, it comes back black
    except OSError:
        return None
    finally:
        ImageFile.LOAD_TRUNCATED_IMAGES = False
