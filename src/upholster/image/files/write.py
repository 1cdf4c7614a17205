"""Writing images: PNG, JPEG, WebP, TIFF and OpenEXR, each at the depth that it holds."""

import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
from OpenImageIO import ImageOutput, ImageSpec, geterror

from upholster.base.errors import InputError, nearest
from upholster.base.files import write_bytes
from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel, from_linear, to_linear
from upholster.image.files.native import scratch_file, silent

__all__ = ["IMAGE_SUFFIXES", "ImageFormat", "encode_image", "write_image"]

ImageFormat = Literal["png", "jpeg", "webp", "tiff", "exr"]

IMAGE_SUFFIXES: dict[str, ImageFormat] = {
    ".png": "png",
    ".jpg": "jpeg",
    ".jpeg": "jpeg",
    ".webp": "webp",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".exr": "exr",
}
"""The format for each suffix of file names."""

_SIDE_LIMIT = {"jpeg": 65535, "webp": 16383}
_PNG = {"png:compressionLevel": 4, "png:filter": 32}
"""Deflate at level 4, each row predicted by the one above: as small as the defaults in half their time."""


def write_image(
    path: str | os.PathLike[str], pixels: PixelArray, *, quality: int = 90, bits: Literal[8, 16] | None = None
) -> None:
    """Write an image file; the suffix of `path` decides the format.

    Parameters
    ----------
    path
        Ends in .png, .jpg, .jpeg, .webp, .tif, .tiff or .exr; see `encode_image` for what each keeps.
    pixels, quality, bits
        As for `encode_image`.

    Raises
    ------
    InputError
        If the suffix is unknown, the format cannot hold the image, or the file cannot be written.
    """
    path = Path(path)
    kind = IMAGE_SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"suffix of {path.name!r} is unknown; {nearest(path.suffix, IMAGE_SUFFIXES)}")
    data = encode_image(pixels, kind, quality=quality, bits=bits)
    try:
        write_bytes(path, data)
    except OSError as error:
        raise InputError(f"{os.fspath(path)!r} cannot be written: {error.strerror}") from None


def encode_image(
    pixels: PixelArray, kind: ImageFormat, *, quality: int = 90, bits: Literal[8, 16] | None = None
) -> bytes:
    """Return an image as the bytes of a file.

    Integers are sRGB-coded, floats linear, and are converted if the format needs the other. Formats keep:

    ====== ============================ ===========================================================
    format samples                      channels
    ====== ============================ ===========================================================
    png    uint8, uint16                all
    jpeg   uint8                        grey, RGB; alpha is laid over white
    webp   uint8                        RGB, with alpha or without; grey becomes RGB
    tiff   uint8, uint16, float32       all
    exr    half (of uint8), float32     all; alpha is premultiplied, as OpenEXR prescribes
    ====== ============================ ===========================================================

    Parameters
    ----------
    pixels
        (H, W, C), C from 1 to 4; uint8, uint16 or float32 (finite).
    kind
        The format.
    quality
        1 to 100, for jpeg and webp; webp at 100 is lossless.
    bits
        8 or 16: depth of the integers in png or tiff, if it is not that of `pixels`. By default floats become
        8-bit in png.

    Raises
    ------
    InputError
        If an argument is outside that, or the image is too large for the format (webp: 16383 each way).
    """
    known = set(IMAGE_SUFFIXES.values())
    if kind not in known:
        raise InputError(f"image format {kind!r} is unknown; {nearest(kind, sorted(known))}")
    if not 1 <= quality <= 100:
        raise InputError(f"quality is {quality}; allowed: 1 to 100")
    if bits not in (None, 8, 16):
        raise InputError(f"bits is {bits}; allowed: 8 or 16")
    if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4 or 0 in pixels.shape:
        raise InputError(f"image has shape {pixels.shape}; allowed: (H, W, C) with C from 1 to 4")
    if pixels.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"image has dtype {pixels.dtype}; allowed: uint8, uint16 or float32")
    if pixels.dtype == np.float32 and not np.isfinite(pixels.sum(dtype=np.float64)):
        raise InputError("image has samples that are NaN or infinite; allowed: finite ones")
    height, width = pixels.shape[:2]
    limit = _SIDE_LIMIT.get(kind, 1 << 20)
    if max(height, width) > limit:
        raise InputError(f"image is {width}x{height} pixels; allowed in {kind}: up to {limit} each way")
    # Half floats hold each of the 256 sRGB codes; 16-bit codes need more.
    narrow = kind == "exr" and pixels.dtype == np.uint8
    pixels = np.ascontiguousarray(_converted(pixels, kind, bits))
    samples = "half" if narrow else "float" if pixels.dtype == np.float32 else pixels.dtype.name
    spec = ImageSpec(width, height, pixels.shape[2], samples)
    alpha = alpha_channel(pixels.shape[2])
    if alpha is not None:
        spec.channelnames = ("Y", "A") if alpha == 1 else ("R", "G", "B", "A")
        spec.alpha_channel = alpha
    for name, value in _attributes(kind, quality).items():
        spec.attribute(name, value)
    with scratch_file(pixels.nbytes) as name:
        with silent():
            words = _put(name, kind, spec, pixels)
        if words is not None:
            raise InputError(
                f"image cannot be coded as {kind}: {(words.splitlines() or ['no reason given'])[0]}"
            )
        return Path(name).read_bytes()


def _put(name: str, kind: ImageFormat, spec: ImageSpec, pixels: PixelArray) -> str | None:
    """Write the file; return None, or OpenImageIO's error message."""
    file = ImageOutput.create(f"x.{kind}")
    if file is None:
        return str(geterror())
    done = file.open(name, spec) and file.write_image(pixels)
    words = str(file.geterror())
    # Formats that compress the whole image do so at the end.
    done = file.close() and done
    return None if done else words or str(file.geterror())


def _converted(pixels: PixelArray, kind: ImageFormat, bits: Literal[8, 16] | None) -> PixelArray:
    """Return the image in the depth and the channels that the format holds."""
    if kind == "exr":
        linear = to_linear(pixels)
        alpha = alpha_channel(pixels.shape[2])
        if alpha is None:
            return linear
        return np.concatenate([linear[:, :, :alpha] * linear[:, :, alpha:], linear[:, :, alpha:]], axis=2)
    if kind == "jpeg" and pixels.shape[2] in (2, 4):
        linear = to_linear(pixels)
        cover = linear[:, :, -1:]
        pixels = from_linear(linear[:, :, :-1] * cover + (1 - cover), np.uint8)
    if pixels.dtype == np.float32:
        if kind != "tiff" or bits is not None:
            pixels = from_linear(pixels, np.uint16 if bits == 16 and kind in ("png", "tiff") else np.uint8)
    elif pixels.dtype == np.uint16 and (bits == 8 or kind in ("jpeg", "webp")):
        pixels = ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)
    elif pixels.dtype == np.uint8 and bits == 16 and kind in ("png", "tiff"):
        pixels = pixels * np.uint16(257)
    if kind == "webp" and pixels.shape[2] < 3:
        pixels = pixels[:, :, [0, 0, 0] if pixels.shape[2] == 1 else [0, 0, 0, 1]]
    return pixels


def _attributes(kind: ImageFormat, quality: int) -> dict[str, Any]:
    match kind:
        case "png":
            return {**_PNG, "oiio:UnassociatedAlpha": 1}
        case "jpeg":
            colors = "4:4:4" if quality >= 90 else "4:2:0"
            return {"Compression": f"jpeg:{quality}", "jpeg:subsampling": colors}
        case "webp":
            compression = "lossless" if quality == 100 else f"webp:{quality}"
            return {"Compression": compression, "webp:method": 2, "oiio:UnassociatedAlpha": 1}
        case "tiff":
            return {"Compression": "zip", "oiio:UnassociatedAlpha": 1}
        case _:
            return {"Compression": "zip"}
