"""Reading exemplars: photos straight from a phone work, damaged files are refused.

OpenImageIO decodes the files, including palettes, 1…4-bit samples and plain CMYK. This module handles depth,
alpha, orientation and damage; profiles are in `upholster.image.profiles`, HEIC and AVIF in
`upholster.image.heif`.
"""

import os
import re
import stat
from contextlib import suppress
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from upholster.errors import InputError
from upholster.files import path_text
from upholster.image.color import alpha_channel
from upholster.image.heif import heif_kind, read_heif
from upholster.image.masks import Used, as_map, filled, is_white
from upholster.image.native import scratch_file, silent
from upholster.image.preparing import MAX_SIDE, MIN_SIDE, check_resize, cut_out, finished
from upholster.image.profiles import PHOTOS, Notes, ink_samples, is_cmyk, tell, to_srgb
from upholster.image.rectify import Corners
from upholster.included import sample_path
from upholster.options import SampleOptions
from upholster.types import MAX_SAMPLE, PixelArray

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

_FORMATS = ("png", "jpeg", "webp", "tiff", "openexr")
_ALLOWED = "allowed: PNG, JPEG, WebP, TIFF, OpenEXR, HEIC, AVIF"
_MAGIC = re.compile(rb"\x89PNG\r\n\x1a\n|\xff\xd8\xff|RIFF....WEBP|II[*+]\0|MM\0[*+]|v/1\x01", re.DOTALL)
_KEPT = {"uint8": "uint8", "uint16": "uint16", "half": "float32", "float": "float32", "double": "float32"}


def read_exemplar(
    path: str | os.PathLike[str],
    *,
    rectify: Corners | None = None,
    crop: tuple[int, int, int, int] | None = None,
    resize: int | str | tuple[int, int] | None = None,
    even_light: bool = False,
    notes: Notes | None = None,
) -> PixelArray:
    """Read an exemplar from a PNG, JPEG, WebP, TIFF or OpenEXR file, or from HEIC or AVIF.

    The orientation tag is applied, palettes and CMYK become grey or RGB, colour profiles are converted to
    sRGB, premultiplied alpha is unpremultiplied. If a file has several images, the first one is read.

    Parameters
    ----------
    path
        The file. Its content, not its suffix, decides its format. ``sample:bricks`` names a sample that is
        included in the program.
    rectify
        Four corners of a rectangle, (x, y) in pixels of the upright image, (0, 0) its top left corner: top
        left, top right, bottom right, bottom left. The rectangle becomes the image, see
        `upholster.image.rectify.Rectification`.
    crop
        (x, y, width, height) in pixels of the upright, rectified image: the part to use.
    resize
        After cropping: the longer side in pixels, as ``256`` or ``"256"``, or both sides, as ``(256, 128)``
        or ``"256x128"`` (width first). In linear light, weighted with alpha, without aliasing.
    even_light
        Whether vignetting and slow shading are removed, see `upholster.image.even_light.even_light`.
    notes
        A list that gets what the user should know, in words: a colour profile that could not be applied.
        Without a list these become warnings.

    Returns
    -------
    ndarray
        (H, W, C), C from 1 to 4, sides from 32 to 4096. uint8 (for 1…8-bit samples) or uint16 as stored,
        sRGB-coded; float32 for half, float and double, linear.

    Raises
    ------
    InputError
        If the file is missing, not a file, unreadable, empty, no image, truncated or damaged; if its samples
        are signed or 32-bit integers, or NaN, infinite or beyond 65504, or floats with a range like 0 to 255
        (`check_white`); if its channels are none of grey, grey and alpha, RGB, RGB and alpha; if corners or
        crop are not inside the image; if the size is outside the limits; if its format needs a library that
        is missing; if the program includes no sample of that name.
    """
    options = SampleOptions(rectify=rectify, crop=crop, resize=resize, even_light=even_light)
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
    whole = options.rectify is None and options.crop is None and options.resize is None
    with silent():
        pixels = _upright(name, whole, True, notes)
    if options.rectify is not None or options.use is not None:
        # That would spread a NaN and hide its origin, as would resizing.
        _check_samples(pixels, repr(name))
    maps = {"albedo": pixels}
    if options.use is not None:
        pixels, used = read_used(options.use, pixels, notes=notes)
        maps = {"albedo": filled(pixels, used), "used": as_map(used)}
    maps = cut_out(maps, options)
    _check_samples(maps["albedo"], repr(name))
    maps = finished(maps, options)
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
        pixels = _upright(name, False, colors, notes)
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
        raise InputError(f"{name!r} does not exist") from None
    except OSError as error:
        raise InputError(f"{name!r} cannot be read: {error.strerror}") from None
    if not (_MAGIC.match(head) or heif_kind(head)):
        raise InputError(f"{name!r} is not a readable image; {_ALLOWED}")
    return name


def _upright(name: str, whole: bool, colors: bool, notes: Notes | None) -> PixelArray:
    """Return a file's pixels, upright and in sRGB; `whole`: they will not be cropped or reduced."""
    with open(name, "rb") as file:
        heif = heif_kind(file.read(32))
    if heif is None:
        try:
            pixels, orientation, profile = _decode(name, whole, colors, notes)
        except UnicodeDecodeError:  # channel names, or an error message that quotes the file
            raise InputError(f"{name!r} is damaged: its texts are not UTF-8") from None
        pixels = _turned(pixels, orientation)
    else:
        pixels, profile = read_heif(name, heif, check=_check_pixels, notes=notes)
        if whole:
            _check_size(pixels.shape[1], pixels.shape[0], repr(name))
    return to_srgb(name, pixels, profile, notes) if profile and colors else pixels


def _decode(
    name: str, whole: bool, colors: bool, notes: Notes | None
) -> tuple[PixelArray, int, bytes | None]:
    """Return pixels, unpremultiplied, the orientation tag, and their colour profile."""
    wish = ImageSpec()
    wish.attribute("oiio:UnassociatedAlpha", 1)
    file = _opened(name, wish)
    try:
        spec = file.spec()
        if file.format_name() not in _FORMATS:
            raise InputError(f"{name!r} is a {file.format_name()} file; {_ALLOWED}")
        if whole:
            _check_size(spec.width, spec.height, repr(name))
        else:
            _check_pixels(name, spec.width, spec.height, spec.image_bytes(True))
        dtype = _KEPT.get(str(spec.format))
        if spec.deep or spec.depth > 1 or dtype is None:
            kind = "deep" if spec.deep else "volume" if spec.depth > 1 else str(spec.format)
            raise InputError(f"{name!r} has {kind} samples; allowed: unsigned 8- or 16-bit integers, floats")
        _check_channels(name, spec, file.format_name())
        pixels = _read_whole(name, file, spec)
    finally:
        file.close()
        _forget_errors()
    orientation = spec.get_int_attribute("Orientation", 1)
    data = spec.getattribute("ICCProfile")
    profile = None if data is None else np.asarray(data, np.uint8).tobytes()
    if colors and _has_inks(spec, profile):
        assert profile is not None
        inks = _inks(name, file.format_name(), notes)
        # Samples that could not be converted still have four channels: then OpenImageIO's RGB must do.
        found = None if inks is None else to_srgb(name, inks, profile, notes)
        return (pixels if found is None or found.shape[2] == 4 else found), orientation, None
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinite, and is then refused
        pixels = pixels.astype(dtype, copy=False)
    # PNG and WebP hold straight alpha, OpenEXR premultiplied; TIFF says which.
    straight = file.format_name() in ("png", "webp") or spec.get_int_attribute("oiio:UnassociatedAlpha") == 1
    if spec.alpha_channel >= 0 and not straight:
        pixels = _unpremultiplied(pixels)
    return pixels, orientation, profile


def _forget_errors() -> None:
    """Clear pending errors, which would turn up at the next call."""
    with suppress(UnicodeDecodeError):
        geterror()


def _opened(name: str, wish: ImageSpec) -> ImageInput:
    file = ImageInput.open(name, wish)
    if file is None:
        raise InputError(f"{name!r} cannot be decoded: {_one_line(geterror())}")
    return file


def _read_whole(name: str, file: ImageInput, spec: ImageSpec) -> PixelArray:
    pixels = file.read_image(0, 0, 0, spec.nchannels, spec.format)
    words = file.geterror()
    # A truncated JPEG file gives pixels, grey below the cut, and an error: not usable as an exemplar.
    if pixels is None or words:
        raise InputError(f"{name!r} is truncated or damaged: {_one_line(words)}")
    whole: PixelArray = pixels.reshape(spec.height, spec.width, spec.nchannels)
    return whole


def _has_inks(spec: ImageSpec, profile: bytes | None) -> bool:
    """Return whether RGB was made of cyan, magenta, yellow and black, and a profile describes these."""
    return profile is not None and is_cmyk(profile) and spec.nchannels == 3


def _inks(name: str, kind: str, notes: Notes | None) -> PixelArray | None:
    """Return a CMYK file's own samples; None, and a note, if no library gives them."""
    if kind == "jpeg":
        inks = ink_samples(name)
        if inks is None:
            tell(notes, f"{name!r}: the CMYK profile was not applied, which needs: {PHOTOS}")
        return inks
    wish = ImageSpec()
    wish.attribute("oiio:RawColor", 1)
    file = _opened(name, wish)
    try:
        inks = _read_whole(name, file, file.spec())
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
    if min(width, height) < MIN_SIDE:
        raise InputError(f"{name} is {width}x{height} pixels; allowed: {MIN_SIDE}x{MIN_SIDE} or more")
    if max(width, height) > largest:
        raise InputError(
            f"{name} is {width}x{height} pixels; allowed: up to {largest} each way; use --resize {largest}"
        )


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


def _one_line(words: str) -> str:
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    return lines[0] if lines else "no reason given"


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
