"""Decoding PNG, JPEG, WebP, TIFF and OpenEXR files by OpenImageIO.

Palettes, samples of 1 to 4 bits and plain CMYK are OpenImageIO's work. `upholster.image.files.statements`
reads what files say of themselves.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from upholster.base.errors import InputError
from upholster.base.formats import IMAGES_READ
from upholster.base.types import PixelArray
from upholster.image.color import alpha_channel
from upholster.image.files.jpeg import START, base_image
from upholster.image.files.native import scratch_file
from upholster.image.files.statements import Stated, stated
from upholster.image.icc import Profile
from upholster.image.profiles import PHOTOS, Notes, ink_samples, is_cmyk, tell, to_srgb

__all__ = ["ALLOWED", "SizeCheck", "decode_file"]

ALLOWED = f"allowed: {IMAGES_READ}"
"""All formats, for messages."""

_FORMATS = ("png", "jpeg", "webp", "tiff", "openexr")
_KEPT = {"uint8": "uint8", "uint16": "uint16", "half": "float32", "float": "float32", "double": "float32"}

_LARGEST_JPEG = 1 << 30

_OF_PIXELS = "JPEG error"
"""How OpenImageIO begins what the JPEG library says."""

_AFTER_ALL = "before marker 0xd9"
"""Where it found stray bytes, if that is after the whole picture."""

_UNSUPPORTED = "support is not configured"
"""What the TIFF library says of a compression that it was built without."""

SizeCheck = Callable[[str, int, int, int], None]
"""Raises if an image is too large; gets its name, width, height, and size in bytes."""


def decode_file(
    name: str, *, check: SizeCheck, colors: bool = True, notes: Notes | None = None
) -> tuple[PixelArray, Stated]:
    """Return a file's pixels, and what it says of itself.

    Parameters
    ----------
    name
        A file of one of the five formats.
    check
        Raises if an image is too large to be decoded; gets its name, width, height, and size in bytes.
    colors
        Whether samples are colours; else inks become RGB by a plain formula.
    notes
        See `upholster.image.profiles.to_srgb`; also gets a note of damage that lacks no pixel.

    Returns
    -------
    pixels, stated
        (H, W, C), C from 1 to 4, uint8, uint16 or float32, alpha not premultiplied, as the file has them: not
        turned upright, and not converted by a profile, except those for inks.

    Raises
    ------
    InputError
        If the file is damaged or too large, or has other samples or channels than these.
    """
    data = _jpeg_data(name)
    base, faults = base_image(data)
    if base == data:
        return _decoded(name, name, check, colors, notes)
    with scratch_file(len(base)) as place:
        Path(place).write_bytes(base)
        found = _decoded(name, place, check, colors, notes)
    if faults:
        tell(notes, f"{name!r} has {', '.join(faults)} in its header; no pixel is missing")
    return found


def _jpeg_data(name: str) -> bytes:
    """Return a JPEG file's bytes; of other files, and of any beyond a GiB, none."""
    with open(name, "rb") as file:
        start = file.read(len(START))
        if start != START or os.fstat(file.fileno()).st_size > _LARGEST_JPEG:
            return b""
        return start + file.read()


def _decoded(
    name: str, place: str, check: SizeCheck, colors: bool, notes: Notes | None
) -> tuple[PixelArray, Stated]:
    """Decode the file at a place; `name` is for messages."""
    request = ImageSpec()
    request.attribute("oiio:UnassociatedAlpha", 1)
    file = _opened(name, place, request)
    try:
        kind, spec = file.format_name(), file.spec()
        _check_spec(name, kind, spec)
        check(name, spec.width, spec.height, spec.image_bytes(True))
        pixels = _read_whole(name, place, file, spec, notes)
    finally:
        file.close()
        _forget_errors()
    found = stated(place, kind, spec)
    if colors and _has_inks(spec, found.profile):
        assert isinstance(found.profile, bytes)
        inks = _inks(name, place, kind, notes)
        # Samples that could not be converted still have four channels: then OpenImageIO's RGB must do.
        mixed = None if inks is None else to_srgb(name, inks, found.profile, notes)
        found = replace(found, profile=None)
        return (pixels if mixed is None or mixed.shape[2] == 4 else mixed), found
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinite, and is then refused
        pixels = pixels.astype(_KEPT[str(spec.format)], copy=False)
    return (_unpremultiplied(pixels) if found.premultiplied else pixels), found


def _check_spec(name: str, kind: str, spec: ImageSpec) -> None:
    """Refuse formats, samples and channels that exemplars do not have."""
    if kind not in _FORMATS:
        raise InputError(f"{name!r} is a {kind} file; {ALLOWED}")
    if spec.deep or spec.depth > 1 or str(spec.format) not in _KEPT:
        words = "deep" if spec.deep else "volume" if spec.depth > 1 else str(spec.format)
        raise InputError(f"{name!r} has {words} samples; allowed: unsigned 8- or 16-bit integers, floats")
    _check_channels(name, spec, kind)


def _forget_errors() -> None:
    """Clear pending errors, which would turn up at the next call."""
    with suppress(UnicodeDecodeError):
        geterror()


def _opened(name: str, place: str, request: ImageSpec) -> ImageInput:
    file = ImageInput.open(place, request)
    if file is None:
        raise InputError(f"{name!r} cannot be decoded: {_one_line(geterror(), place)}")
    return file


def _read_whole(name: str, place: str, file: ImageInput, spec: ImageSpec, notes: Notes | None) -> PixelArray:
    before = file.geterror()
    pixels = file.read_image(0, 0, 0, spec.nchannels, spec.format)
    words = file.geterror()
    # Progressive JPEG files are decoded while they are opened; anything else until then is about metadata.
    if before.startswith(_OF_PIXELS) and _AFTER_ALL not in before:
        words = before
    # A truncated JPEG file gives pixels, grey below the cut, and an error: not usable as an exemplar.
    if pixels is None or words:
        raise InputError(f"{name!r} is {_problem(words)}: {_one_line(words, place)}")
    if before and not words:
        tell(notes, f"{name!r}: {_one_line(before, place)}; no pixel is missing")
    whole: PixelArray = pixels.reshape(spec.height, spec.width, spec.nchannels)
    return whole


def _problem(words: str) -> str:
    return "packed in a way that is not supported" if _UNSUPPORTED in words else "truncated or damaged"


def _has_inks(spec: ImageSpec, profile: bytes | Profile | None) -> bool:
    """Return whether RGB was made of cyan, magenta, yellow and black, and a profile describes these."""
    return isinstance(profile, bytes) and is_cmyk(profile) and spec.nchannels == 3


def _inks(name: str, place: str, kind: str, notes: Notes | None) -> PixelArray | None:
    """Return a CMYK file's own samples; None, and a note, if no library gives them."""
    if kind == "jpeg":
        inks = ink_samples(place)
        if inks is None:
            tell(notes, f"{name!r}: the CMYK profile was not applied, which needs: {PHOTOS}")
        return inks
    request = ImageSpec()
    request.attribute("oiio:RawColor", 1)
    file = _opened(name, place, request)
    try:
        inks = _read_whole(name, place, file, file.spec(), notes)
    finally:
        file.close()
        _forget_errors()
    if inks.shape[2] != 4:
        tell(notes, f"{name!r}: the colour profile was not applied: it is for CMYK")
        return None
    return inks


def _check_channels(name: str, spec: ImageSpec, kind: str) -> None:
    expected = alpha_channel(spec.nchannels) if spec.nchannels <= 4 else None
    alpha = spec.alpha_channel if spec.alpha_channel >= 0 else None
    # TIFF files may leave the meaning of an extra channel open; simple programs write alpha this way.
    unsaid = kind == "tiff" and alpha is None and spec.z_channel < 0
    if spec.nchannels > 4 or not (alpha == expected or unsaid):
        names = ", ".join(spec.channelnames[:8])
        raise InputError(
            f"{name!r} has {spec.nchannels} channels ({names}); allowed: grey or RGB, with or without alpha"
        )


def _unpremultiplied(pixels: PixelArray) -> PixelArray:
    """Divide colour by alpha; where alpha is 0 there is no colour to recover, and the value stays."""
    alpha = pixels[:, :, -1:].astype(np.float32)
    alpha[alpha == 0] = 1.0 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    with np.errstate(over="ignore", invalid="ignore"):  # checked afterwards
        color = pixels[:, :, :-1] / alpha
    if pixels.dtype.kind != "f":
        top = np.iinfo(pixels.dtype).max
        color = np.minimum(color * top + 0.5, top)
    pixels = pixels.copy()
    pixels[:, :, :-1] = color
    return pixels


def _one_line(words: str, place: str) -> str:
    """Return the first of OpenImageIO's words, without the file's name, which the message has."""
    words = words.replace(f' ("{place}")', "").replace(f'"{place}"', "the file")
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    return lines[0] if lines else "no reason given"
