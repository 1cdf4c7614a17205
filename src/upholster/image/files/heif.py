"""HEIC and AVIF files, through libraries that are installed on demand: pi-heif (LGPL) and Pillow."""

import re
import warnings
from pathlib import Path
from struct import unpack
from typing import Literal

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import PixelArray
from upholster.image.files.image_decoder import SizeCheck
from upholster.image.files.statements import Stated, stated_in_heif
from upholster.image.profiles import PHOTOS, Notes, tell

__all__ = ["heif_kind", "read_heif"]

HeifKind = Literal["HEIC", "AVIF"]

_HEAD = 1 << 16
"""Bytes at a file's beginning that hold its description."""

_SIZE = re.compile(rb"ispe.{4}(.{8})", re.DOTALL)

_MOST_OF_LIBRARIES = 1 << 28
"""Pixels that libavif decodes by default; libheif decodes more."""

_BRANDS: dict[bytes, HeifKind] = {
    b"avif": "AVIF",
    b"avis": "AVIF",
    **dict.fromkeys((b"heic", b"heix", b"hevc", b"hevx", b"heim", b"heis", b"mif1", b"msf1"), "HEIC"),
}


def heif_kind(head: bytes) -> HeifKind | None:
    """Return whether a file that begins with `head` (16 bytes or more) is HEIC or AVIF; None: neither."""
    if head[4:8] != b"ftyp":
        return None
    kind = _BRANDS.get(head[8:12])
    # "mif1" says only that there is an image; the compatible brands give its coding.
    return "AVIF" if kind and b"avif" in head[12:] else kind


def read_heif(
    name: str, kind: HeifKind, *, check: SizeCheck, notes: Notes | None
) -> tuple[PixelArray, Stated]:
    """Read a HEIC or AVIF file.

    Parameters
    ----------
    name
        The file.
    kind
        HEIC or AVIF.
    check
        Raises if an image is too large to be decoded; gets its name, width, height, and size in bytes.
    notes
        See `upholster.image.profiles.to_srgb`.

    Returns
    -------
    ndarray
        (H, W, C), upright: uint8; uint16 over its whole range for HEIC with more than 8 bits.
    Stated
        What it says of itself.

    Raises
    ------
    InputError
        If the library is missing (the message says what to install), or the file is damaged or too large.
    """
    with Path(name).open("rb") as file:
        head = file.read(_HEAD)
    width, height = _stated_size(head)
    check(name, width, height, width * height)
    try:
        pixels, profile = (_heic if kind == "HEIC" else _avif)(name, check)
    except ImportError:
        raise InputError(f"{name!r} is {_article(kind)} file, which needs: {PHOTOS}") from None
    except InputError:
        raise
    except Exception as error:  # each library raises its own kinds
        if width * height > _MOST_OF_LIBRARIES:
            raise InputError(
                f"{name!r} is {width}x{height} pixels, too large for the library that reads {kind}; "
                f"allowed: {_MOST_OF_LIBRARIES:,} in all"
            ) from None
        words = (str(error).splitlines() or ["no reason given"])[0]
        raise InputError(f"{name!r} is truncated or damaged: {words}") from None
    pixels = pixels if pixels.ndim == 3 else pixels[:, :, None]
    if kind == "AVIF" and _is_deep(head):
        tell(notes, f"{name!r}: AVIF of more than 8 bits is read at 8 bits")
    return pixels, stated_in_heif(profile, head, pixels.shape[2])


def _heic(name: str, check: SizeCheck) -> tuple[PixelArray, bytes | None]:
    import pi_heif

    # The decoder itself turns the image upright, and scales 10 and 12 bits to 16.
    image = pi_heif.open_heif(name, convert_hdr_to_8bit=False, hdr_to_16bit=True)
    width, height = image.size
    sample = 2 if ";16" in image.mode else 1
    check(name, width, height, width * height * len(image.mode.split(";")[0]) * sample)
    pixels = np.array(image)
    return pixels, image.info.get("icc_profile")


def _avif(name: str, check: SizeCheck) -> tuple[PixelArray, bytes | None]:
    from PIL import Image, ImageOps, features

    if not features.check("avif"):
        raise ImportError("Pillow without AVIF")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about its own limits, and about metadata
        with Image.open(name) as image:
            width, height = image.size
            check(name, width, height, width * height * len(image.getbands()))
            image.load()
            pixels = np.array(ImageOps.exif_transpose(image))
    return pixels, image.info.get("icc_profile")


def _stated_size(head: bytes) -> tuple[int, int]:
    """Return width and height of a file's largest image, (0, 0) if they are not found (ISO 23008-12, 6.5.3).

    The libraries refuse large files with words that do not mention the size.
    """
    sizes: list[tuple[int, int]] = [unpack(">II", one) for one in _SIZE.findall(head)]
    return max(sizes, key=lambda size: size[0] * size[1], default=(0, 0))


def _is_deep(head: bytes) -> bool:
    """Return whether an AVIF file declares more than 8 bits: AV1 in ISOBMFF 1.3, section 2.3.3."""
    place = head.find(b"av1C")
    return place >= 0 and len(head) > place + 6 and bool(head[place + 6] & 0x40)


def _article(kind: HeifKind) -> str:
    return "a HEIC" if kind == "HEIC" else "an AVIF"
