"""Reading exemplars: photos straight from a phone work, damaged files are refused.

Files are decoded by `upholster.image.files.image_decoder`, HEIC and AVIF by `upholster.image.files.heif`;
`upholster.image.files.statements` lists what they say of themselves, and what is done with it. This module
turns pictures upright, and checks sizes and samples.
"""

import os
import re
import stat
from pathlib import Path
from typing import Any

import numpy as np

from upholster.base.errors import InputError, nearest
from upholster.base.examples import sample_path
from upholster.base.files import path_text
from upholster.base.options.choices import chosen
from upholster.base.options.sample_options import PREPARING, SampleOptions
from upholster.base.types import MAX_SAMPLE, PixelArray
from upholster.image.color import alpha_channel
from upholster.image.files.heif import heif_kind, read_heif
from upholster.image.files.image_decoder import ALLOWED, decode_file
from upholster.image.files.native import scratch_file, silent
from upholster.image.masks import Used, as_map, filled, is_white
from upholster.image.photo.preparation import MAX_SIDE, MIN_SIDE, check_resize, cut_out, finished
from upholster.image.profiles import Notes, tell, to_srgb

__all__ = [
    "check_exemplar",
    "check_white",
    "read_exemplar",
    "read_image",
    "read_image_data",
    "read_photo",
    "read_used",
]

MAX_BYTES = 1 << 30
"""Limit in bytes, uncompressed, for an image to be cropped or reduced: fits 200 megapixels of 8-bit RGB."""

PIXELS_VARIABLE = "UPHOLSTER_MAX_PIXELS"
"""Environment variable: the most pixels of an image that is to be cropped or reduced."""

MAX_PIXELS = 200_000_000
"""The default if the variable is not set: the largest photos of telephones. A file of 1 MB may hold 1,000
million pixels of one colour, which take a minute and gigabytes to decode."""

_MAGIC = re.compile(rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|RIFF....WEBP|II[*+]\0|MM\0[*+]|v/1\x01", re.DOTALL)


def read_exemplar(path: str | os.PathLike[str], *, notes: Notes | None = None, **choices: Any) -> PixelArray:
    """Read an exemplar from a PNG, JPEG, WebP, TIFF or OpenEXR file, or from HEIC or AVIF.

    The orientation tag is applied, palettes and CMYK become grey or RGB, colour profiles are converted to
    sRGB, premultiplied alpha is unpremultiplied. If a file has several images, the first one is read.

    Parameters
    ----------
    path
        The file. Its content, not its suffix, decides its format. ``sample:bricks`` names a sample that is
        included in the program.
    notes
        A list that gets what the user should know, in words: a colour profile that could not be applied.
        Without a list these become warnings.
    **choices
        How the photo is prepared: `rectify`, `crop`, `resize` and `even_light` of `upholster.SampleOptions`.

    Returns
    -------
    ndarray
        (H, W, C), C from 1 to 4, sides from 32 to 4096: larger images are reduced, with a note. uint8 (for
        1…8-bit samples) or uint16 as stored, sRGB-coded; float32 for half, float and double, linear.

    Raises
    ------
    InputError
        If the file is missing, not a file, unreadable, empty, no image, truncated or damaged; if its samples
        are signed or 32-bit integers, or NaN, infinite or beyond 65504, or floats with a range like 0 to 255
        (`check_white`); if its channels are none of grey, grey and alpha, RGB, RGB and alpha; if corners or
        crop are not inside the image; if the size is outside the limits; if its format needs a library that
        is missing; if the program includes no sample of that name; for an unknown option.
    """
    for name in choices:
        if name not in PREPARING:
            raise InputError(f"unknown option {name!r} of an image; {nearest(name, PREPARING)}")
    options = chosen(SampleOptions, **choices)
    return read_photo(sample_path(path_text(path, "image")), options, notes=notes)[0]


def read_photo(
    path: str | os.PathLike[str], options: SampleOptions, *, notes: Notes | None = None
) -> tuple[PixelArray, Used | None]:
    """Read an exemplar as `read_exemplar` does, and the mask of its used pixels; None: all.

    Unused pixels are replaced before anything is averaged.

    Raises
    ------
    InputError
        As for `read_exemplar` and `read_used`.
    """
    name = _checked_file(Path(path_text(path, "image")))
    check_resize(options.resize)
    with silent():
        pixels = _upright(name, True, notes)
    if options.rectify is not None or options.use is not None:
        # That would spread a NaN and hide its origin, as would resizing.
        _check_samples(pixels, repr(name))
    maps = {"albedo": pixels}
    if options.use is not None:
        pixels, used = read_used(options.use, pixels, notes=notes)
        maps = {"albedo": filled(pixels, used), "used": as_map(used)}
    maps = cut_out(maps, options)
    _check_samples(maps["albedo"], repr(name))
    height, width = maps["albedo"].shape[:2]
    _check_least(width, height, repr(name))
    maps = finished(maps, options, notes)
    pixels = maps["albedo"]
    _check_size(pixels.shape[1], pixels.shape[0], repr(name))
    check_white(pixels, repr(name))
    return np.ascontiguousarray(pixels), is_white(maps["used"]) if "used" in maps else None


def read_used(use: str, pixels: PixelArray, *, notes: Notes | None = None) -> tuple[PixelArray, Used]:
    """Read which pixels of a photo are used.

    Parameters
    ----------
    use
        A mask's file, white where pixels are used; or "alpha": the photo's own, then no longer transparency.
    pixels
        (H, W, C), the upright photo.
    notes
        As for `read_exemplar`.

    Returns
    -------
    pixels, used
        The photo, without its alpha if that was the mask; (H, W) bool.

    Raises
    ------
    InputError
        As for `read_image`; if the mask has another height or width, or nothing is used; for "alpha" if the
        photo has none.
    """
    height, width = pixels.shape[:2]
    if use == "alpha":
        alpha = alpha_channel(pixels.shape[2])
        if alpha is None:
            raise InputError("use is 'alpha', but the sample has none; allowed: a mask's file")
        used, pixels = is_white(pixels[:, :, alpha:]), pixels[:, :, :alpha]
    else:
        mask = read_image(use, colors=False, notes=notes)
        if mask.shape[:2] != (height, width):
            raise InputError(
                f"mask {use!r} is {mask.shape[1]}x{mask.shape[0]} pixels; allowed: {width}x{height}, as the "
                "upright photo"
            )
        used = is_white(mask)
    if not used.any():
        raise InputError(f"use {use!r} leaves nothing of the sample; allowed: a mask that is white somewhere")
    return pixels, used


def read_image(
    path: str | os.PathLike[str], *, colors: bool = True, notes: Notes | None = None
) -> PixelArray:
    """Read an image of any size, as `read_exemplar` does.

    Parameters
    ----------
    path, notes
        As for `read_exemplar`.
    colors
        Whether samples are colours; if they are plain numbers, a colour profile is ignored.

    Returns
    -------
    ndarray
        (H, W, C), C from 1 to 4; uint8, uint16 or float32.

    Raises
    ------
    InputError
        As for `read_exemplar`; or if the image has more than 200 million pixels (or the number in the
        environment variable UPHOLSTER_MAX_PIXELS), or takes more than 1 GiB.
    """
    name = _checked_file(Path(path_text(path, "image")))
    with silent():
        pixels = _upright(name, colors, notes)
    _check_samples(pixels, repr(name))
    return np.ascontiguousarray(pixels)


def check_exemplar(array: object, *, lamp: bool = False, largest: int = MAX_SIDE) -> PixelArray:
    """Check an exemplar given as an array, and convert it to the project's shape and dtypes.

    Parameters
    ----------
    array
        (H, W) or (H, W, C), C from 1 to 4, sides from 32 to 4096; uint8, uint16 (sRGB-coded) or float16,
        float32, float64 (linear, finite, magnitudes up to 65504).
    lamp
        Whether it is emitted light, which may be beyond 1 everywhere.
    largest
        Most pixels of a side, if not 4096.

    Returns
    -------
    ndarray
        (H, W, C), contiguous, uint8, uint16 or float32; the same array if it already fits.

    Raises
    ------
    InputError
        If shape, size, dtype or samples are outside that, or floats have a range like 0 to 255, see
        `check_white`.
    """
    if not isinstance(array, np.ndarray):
        raise InputError(f"sample is a {type(array).__name__}; allowed: a NumPy array or a path")
    array = np.asarray(array).astype(array.dtype.newbyteorder("="), copy=False)
    if array.dtype not in (np.uint8, np.uint16, np.float16, np.float32, np.float64):
        raise InputError(f"sample has dtype {array.dtype}; allowed: uint8, uint16, float16, 32, 64")
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or not 1 <= array.shape[2] <= 4:
        raise InputError(f"sample has shape {array.shape}; allowed: (H, W) or (H, W, C) with C from 1 to 4")
    _check_size(array.shape[1], array.shape[0], "sample", largest)
    if array.dtype.kind == "f":
        _check_samples(array, "sample")  # as given: a double beyond float32 must not become infinite first
        array = array.astype(np.float32, copy=False)
        if not lamp:
            check_white(array, "sample")
    return np.ascontiguousarray(array)


def _checked_file(path: Path) -> str:
    """Return the path as text if it is a file of a known image format."""
    name = os.fspath(path)
    if "\0" in name:
        raise InputError(f"path {name!r} contains a null character")
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"{name!r} is a directory; allowed: an image file")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{name!r} is not a regular file; allowed: an image file")
        if status.st_size == 0:
            raise InputError(f"{name!r} is empty; allowed: an image file")
        with path.open("rb") as file:
            head = file.read(32)
    except FileNotFoundError:
        raise InputError(f"{name!r} does not exist; allowed: an image file") from None
    except OSError as error:
        raise InputError(f"{name!r} cannot be read: {error.strerror}") from None
    if not (_MAGIC.match(head) or heif_kind(head)):
        raise InputError(f"{name!r} is not a readable image; {ALLOWED}")
    return name


def _upright(name: str, colors: bool, notes: Notes | None) -> PixelArray:
    """Return a file's pixels, upright and in sRGB."""
    with open(name, "rb") as file:
        heif = heif_kind(file.read(32))
    try:
        if heif is None:
            pixels, found = decode_file(name, check=_check_pixels, colors=colors, notes=notes)
        else:
            pixels, found = read_heif(name, heif, check=_check_pixels, notes=notes)
    except UnicodeDecodeError:  # channel names, or an error message that quotes the file
        raise InputError(f"{name!r} is damaged: its texts are not UTF-8") from None
    pixels = _turned(pixels, found.orientation)
    if colors and found.unknown:
        tell(notes, f"{name!r}: the colour coding {found.unknown} is not converted: colours will be wrong")
    return to_srgb(name, pixels, found.profile, notes) if found.profile and colors else pixels


def _turned(pixels: PixelArray, orientation: int) -> PixelArray:
    """Undo the Exif orientation: 1 to 8, the place of row 0 and column 0 (Exif 2.32, tag 0x0112)."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def _check_size(width: int, height: int, name: str, largest: int = MAX_SIDE) -> None:
    _check_least(width, height, name)
    if max(width, height) > largest:
        raise InputError(f"{name} is {width}x{height} pixels; allowed: up to {largest} each way")


def _check_least(width: int, height: int, name: str) -> None:
    if min(width, height) < MIN_SIDE:
        raise InputError(f"{name} is {width}x{height} pixels; allowed: {MIN_SIDE}x{MIN_SIDE} or more")


def _check_pixels(name: str, width: int, height: int, size: int) -> None:
    """Refuse an image of any size by its header; `size` is its uncompressed size in bytes."""
    most = _most_pixels()
    if width * height > most:
        raise InputError(
            f"{name!r} is {width}x{height} pixels; allowed: {most:,} in all (see {PIXELS_VARIABLE})"
        )
    if size > MAX_BYTES:
        raise InputError(
            f"{name!r} is {width}x{height} pixels, {size >> 20} MiB; "
            f"allowed: {MAX_BYTES >> 20} MiB uncompressed, before cropping"
        )


def _most_pixels() -> int:
    text = os.environ.get(PIXELS_VARIABLE)
    if text is None:
        return MAX_PIXELS
    if not re.fullmatch(r"[1-9][0-9]{0,11}", text):
        raise InputError(
            f"{PIXELS_VARIABLE} is {text!r}; allowed: a whole number of pixels, such as 400000000"
        )
    return int(text)


def _check_samples(pixels: PixelArray, name: str) -> None:
    if pixels.dtype.kind != "f":
        return
    low, high = pixels.min(), pixels.max()
    if not (low >= -MAX_SAMPLE and high <= MAX_SAMPLE):  # false for NaN as well
        bad = np.argwhere(~(np.abs(pixels) <= MAX_SAMPLE))[0]
        row, column, channel = (int(number) for number in bad)
        value = pixels[row, column, channel]
        raise InputError(
            f"{name} has the sample {value} at row {row}, column {column}, channel {channel}; "
            f"allowed: finite, up to {MAX_SAMPLE:.0f}"
        )


def check_white(pixels: PixelArray, name: str) -> None:
    """Raise if floats are not light with white at 1, but numbers of another range, such as 0 to 255.

    Highlights and lamps may be beyond 1, without limit. Another range is recognized if more than half of the
    samples are beyond 1, or all of them are whole numbers. Alpha does not count.
    """
    if pixels.dtype.kind != "f":
        return
    alpha = alpha_channel(pixels.shape[2])
    colors = pixels if alpha is None else pixels[:, :, :alpha]
    most = float(colors.max())
    if most > 1 and (np.median(colors) > 1 or bool((colors == np.rint(colors)).all())):
        raise InputError(
            f"{name} has floats up to {most:g}, most beyond 1 or all whole numbers; allowed: linear light, "
            "white at 1 (highlights may lie beyond); as integers, uint8 or uint16, 255 or 65535 is white"
        )


def read_image_data(
    data: bytes, shown: str, *, colors: bool = True, notes: Notes | None = None
) -> PixelArray:
    """Read an image from its file's bytes, as `read_image` does; `shown` names it in messages.

    OpenImageIO reads files only, so the bytes go through a file, in memory where the system allows.
    """
    with scratch_file(len(data)) as name:
        Path(name).write_bytes(data)
        try:
            return read_image(name, colors=colors, notes=notes)
        except InputError as error:
            raise InputError(str(error).replace(repr(name), repr(shown))) from None
