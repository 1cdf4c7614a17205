"""Colour profiles: samples in any profile are converted to sRGB when a file is read.

Profiles made of a matrix and curves are applied here, in floating point. Profiles that hold tables, such as
those for CMYK, are left to Little CMS, which is part of imagecodecs (16 bits) and Pillow (8 bits).
"""

import os
import warnings
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray, PixelArray
from upholster.image.color import alpha_channel, from_linear, to_linear
from upholster.image.icc import SRGB_TO_XYZ, Profile, read_profile

__all__ = ["PHOTOS", "Notes", "ink_samples", "is_cmyk", "tell", "to_srgb"]

PHOTOS = "pip install 'upholster[photos]'"
"""Installs the libraries that plain files do not need."""

Notes = list[str]
"""Where readers put what the user should know; without a list it becomes a warning."""

_BAND = 1 << 21
"""Samples held in linear light at a time."""

_SAME = 1.0 / 255
"""A profile that changes no colour by more than this is treated as sRGB: samples stay as they are."""

_RELATIVE, _BLACK_POINT = 1, 0x2000
"""Little CMS: relative colorimetric intent; black becomes black."""


def tell(notes: Notes | None, words: str) -> None:
    """Add a note, or warn if there is no list for it."""
    if notes is None:
        warnings.warn(words, stacklevel=4)
    else:
        notes.append(words)


def is_cmyk(profile: bytes) -> bool:
    """Return whether a profile is for samples of cyan, magenta, yellow and black."""
    return profile[16:20] == b"CMYK"


def to_srgb(name: str, pixels: PixelArray, data: bytes | Profile, notes: Notes | None) -> PixelArray:
    """Return samples as the project has them: integers sRGB-coded, floats linear with sRGB's primaries.

    Parameters
    ----------
    name
        The file's name, for notes.
    pixels
        (H, W, C) uint8, uint16 or float32, which may be overwritten: grey or RGB, with alpha or without; or
        (H, W, 4) cyan, magenta, yellow, black, if the profile is for these.
    data
        The ICC profile, or one made of other statements in the file.
    notes
        Gets a note of what could not be done: no library for tables, only 8 bits, a damaged profile.

    Returns
    -------
    ndarray
        (H, W, C) of the same dtype, RGB for CMYK; alpha unchanged. Integers clip colours outside sRGB.
    """
    try:
        profile = data if isinstance(data, Profile) else read_profile(data)
    except FormatError as error:
        tell(notes, f"{name!r}: the colour profile was not applied: {error}")
        return pixels
    alpha = None if profile.space == "CMYK" else alpha_channel(pixels.shape[2])
    colors = pixels.shape[2] if alpha is None else alpha
    if colors != {"GRAY": 1, "RGB": 3, "CMYK": 4}.get(profile.space):
        tell(
            notes, f"{name!r}: the colour profile {profile.name!r} was not applied: it is for {profile.space}"
        )
        return pixels
    if not isinstance(data, Profile) and (profile.tables or not profile.curves):
        table = _by_tables(name, pixels, profile, data, notes)
        if table is not None:
            return table
        if not profile.curves:
            return pixels
    return pixels if _is_srgb(profile, pixels.dtype.kind == "f") else _by_curves(pixels, profile)


def _to_linear_srgb(samples: Iterable[FloatArray], profile: Profile) -> FloatArray:
    """Return the light of samples 0…1, given per channel, as (…, C) linear sRGB."""
    light = np.stack([curve(one) for curve, one in zip(profile.curves, samples, strict=True)], axis=-1)
    if profile.matrix is None:
        return light
    linear: FloatArray = light @ (np.linalg.inv(SRGB_TO_XYZ) @ profile.matrix).T
    return linear


def _is_srgb(profile: Profile, linear: bool) -> bool:
    """Return whether a profile is the default: sRGB, or linear sRGB for floats."""
    axes = [np.linspace(0, 1, 18)] * len(profile.curves)
    lattice = [axis.astype(np.float64) for axis in np.meshgrid(*axes)]
    found = _to_linear_srgb(lattice, profile)
    given = np.stack(lattice, axis=-1)
    if linear:
        return bool(np.abs(found - given).max() <= _SAME)
    coded = from_linear(found.reshape(1, -1, len(axes)), np.uint16)
    return bool(np.abs(coded / 65535 - given.reshape(1, -1, len(axes))).max() <= _SAME)


def _by_curves(pixels: PixelArray, profile: Profile) -> PixelArray:
    count = len(profile.curves)
    if not pixels.flags.writeable:
        pixels = pixels.copy()
    tables: list[NDArray[np.float32]] = []
    if pixels.dtype.kind != "f":
        codes = np.linspace(0, 1, np.iinfo(pixels.dtype).max + 1)
        tables = [curve(codes).astype(np.float32) for curve in profile.curves]
    matrix = np.eye(count) if profile.matrix is None else np.linalg.inv(SRGB_TO_XYZ) @ profile.matrix
    turned = matrix.T.astype(np.float32)
    rows = max(1, _BAND // (pixels.shape[1] * count))
    for start in range(0, pixels.shape[0], rows):
        band = pixels[start : start + rows, :, :count]
        if tables:
            light = np.stack([table[band[:, :, k]] for k, table in enumerate(tables)], axis=2)
            band[...] = from_linear(light @ turned, pixels.dtype)
        else:
            band[...] = _to_linear_srgb(np.moveaxis(band.astype(np.float64), 2, 0), profile)
    return pixels


def _by_tables(
    name: str, pixels: PixelArray, profile: Profile, data: bytes, notes: Notes | None
) -> PixelArray | None:
    """Return samples converted by Little CMS, None if it is missing or fails."""
    colors = {"GRAY": 1, "RGB": 3, "CMYK": 4}[profile.space]
    samples = np.ascontiguousarray(pixels[:, :, :colors])
    if samples.dtype.kind == "f":  # tables end at 0 and 1, so Little CMS would clip the rest anyway
        samples = np.rint(np.clip(samples, 0, 1) * 65535).astype(np.uint16)
    missing = True
    for transform in (_by_imagecodecs, _by_pillow):
        try:
            done = transform(samples, profile.space, data)
        except ImportError:
            continue
        except Exception as error:  # each library raises its own kinds
            missing = False
            words = str(error).splitlines() or ["no reason given"]
            problem = f"Little CMS refuses it: {words[0]}"
            continue
        if done.dtype != samples.dtype:
            tell(
                notes,
                f"{name!r}: the colour profile {profile.name!r} holds tables and was applied at 8 bits; "
                f"for 16 bits: {PHOTOS}",
            )
        return _joined(done, pixels, colors)
    if missing:
        problem = f"it holds tables, which need: {PHOTOS}"
    if not profile.curves:
        tell(notes, f"{name!r}: the colour profile {profile.name!r} was not applied: {problem}")
    return None


def _joined(done: PixelArray, pixels: PixelArray, colors: int) -> PixelArray:
    """Return converted colours at the depth of the file, with its alpha."""
    if pixels.dtype.kind == "f":
        done = to_linear(done)
    elif done.dtype != pixels.dtype:
        done = (done.astype(np.uint16) * 257).astype(pixels.dtype)
    if colors == 1:
        done = done[:, :, :1]  # grey was returned as three equal channels
    if colors == 4 or pixels.shape[2] == colors:
        return np.ascontiguousarray(done)
    return np.concatenate([done, pixels[:, :, colors:]], axis=2)


def _by_imagecodecs(samples: PixelArray, space: str, data: bytes) -> PixelArray:
    import imagecodecs

    if space == "GRAY":
        samples = samples[:, :, 0]
    done: PixelArray = imagecodecs.cms_transform(
        samples,
        data,
        imagecodecs.cms_profile("srgb"),
        colorspace=space.lower(),
        outcolorspace="rgb",
        outdtype=samples.dtype,
        intent=_RELATIVE,
        flags=_BLACK_POINT,
    )
    return done


def _by_pillow(samples: PixelArray, space: str, data: bytes) -> PixelArray:
    from io import BytesIO

    from PIL import Image, ImageCms

    if samples.dtype != np.uint8:
        samples = np.rint(samples / 257.0).astype(np.uint8)
    mode = {"GRAY": "L", "RGB": "RGB", "CMYK": "CMYK"}[space]
    height, width = samples.shape[:2]
    image = Image.frombytes(mode, (width, height), samples.tobytes())
    done = ImageCms.profileToProfile(
        image,
        ImageCms.ImageCmsProfile(BytesIO(data)),
        ImageCms.createProfile("sRGB"),
        renderingIntent=ImageCms.Intent(_RELATIVE),
        outputMode="RGB",
        flags=ImageCms.Flags(_BLACK_POINT),
    )
    assert done is not None
    return np.asarray(done)


def ink_samples(path: str | os.PathLike[str]) -> PixelArray | None:
    """Return a CMYK JPEG's own samples, None if no library gives them.

    OpenImageIO gives RGB, by a plain formula that ignores the profile.

    Returns
    -------
    ndarray
        (H, W, 4) uint8; 255 is full ink.
    """
    try:
        from PIL import Image

        with Image.open(path) as image:
            return np.asarray(image) if image.mode == "CMYK" else None
    except ImportError:
        pass
    except (OSError, ValueError, SyntaxError):
        return None
    try:
        import imagecodecs
    except ImportError:
        return None
    try:
        with open(path, "rb") as file:
            found: PixelArray = imagecodecs.jpeg8_decode(file.read(), outcolorspace="cmyk")
    except (OSError, ValueError, RuntimeError):
        return None
    # Adobe's programs write them so, and all readers expect it: 255 is no ink.
    return 255 - found
