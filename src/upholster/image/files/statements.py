"""What image files say of themselves, and what is done with it: orientation, colours, alpha, depth, gain map.

`STATEMENTS` lists all of it; docs/photos.md has the same table. The functions below read what OpenImageIO
passes on. `upholster.image.files.heif` reads HEIC and AVIF, whose libraries apply most of it themselves.
"""

import mmap
import re
from dataclasses import dataclass
from struct import unpack
from typing import NamedTuple

import numpy as np
from OpenImageIO import ImageSpec

from upholster.image.icc import Chromaticities, GammaCurve, Profile, rgb_profile

__all__ = ["STATEMENTS", "Stated", "Statement", "stated", "stated_in_heif"]


class Statement(NamedTuple):
    """Something that files of one format can say of themselves.

    Attributes
    ----------
    format
        The format's name.
    said
        What about, one word for all formats, and where in the file.
    done
        What is done with it.
    """

    format: str
    said: str
    done: str


STATEMENTS = (
    Statement("all", "orientation: Exif, TIFF, HEIF, else XMP", "turned upright"),
    Statement("all", "colours: ICC profile", "converted to sRGB"),
    Statement("all", "colours: gain map (Ultra HDR, ISO 21496-1, Apple)", "ignored: the base image is read"),
    Statement("JPEG", "colours: Adobe RGB by Exif, without profile", "converted to sRGB"),
    Statement("TIFF", "colours: PrimaryChromaticities without profile", "ignored: sRGB's primaries"),
    Statement("PNG", "colours: cICP, gAMA", "converted; PQ and HLG are not, with a note"),
    Statement("PNG", "colours: cHRM without profile", "ignored: sRGB's primaries"),
    Statement("PNG, WebP", "alpha", "kept; of an opacity map with alpha, the opacity"),
    Statement("PNG, TIFF", "depth: 1 to 8, 10 to 16 bits", "scaled to 8 or 16 bits"),
    Statement("JPEG", "odd header: stray bytes, JFIF revision, scan parameters", "ignored, with a note"),
    Statement("JPEG, TIFF", "colours: CMYK", "converted to sRGB, by the profile if there is one"),
    Statement("TIFF", "alpha: premultiplied, straight or not said", "divided out, kept, kept"),
    Statement("TIFF, OpenEXR", "depth: half, float, double", "float32, linear"),
    Statement("OpenEXR", "colours: chromaticities, adoptedNeutral", "converted to sRGB's primaries, linear"),
    Statement("OpenEXR", "alpha", "premultiplied, so divided out"),
    Statement("HEIC, AVIF", "colours: nclx", "converted; PQ and HLG are not, with a note"),
    Statement("HEIC", "depth: 10 or 12 bits", "scaled to 16 bits"),
    Statement("AVIF", "depth: 10 or 12 bits", "read at 8 bits, with a note"),
    Statement("all", "several images", "the first or main one is read"),
)
"""What is not listed, such as the camera, the place or the resolution, changes no pixel and is ignored."""

_XMP_ORIENTATION = re.compile(rb"tiff:Orientation\s*(?:=\s*[\"']|>)\s*([1-8])")

_UNCALIBRATED = 65535
_ADOBE_RGB = re.compile(b"\1\0\2\0\4\0\0\0R03\0|\0\1\0\2\0\0\0\4R03\0")
"""Exif's tag InteroperabilityIndex, in both orders of bytes."""

_PRIMARIES: dict[str, Chromaticities] = {
    "rec709": ((0.64, 0.33), (0.3, 0.6), (0.15, 0.06), (0.3127, 0.329)),
    "p3d65": ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06), (0.3127, 0.329)),
    "rec2020": ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046), (0.3127, 0.329)),
    "adobergb": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), (0.3127, 0.329)),
}
"""Of red, green, blue and white, by OpenImageIO's names (ITU-T H.273, table 2)."""

_CURVES = {
    "lin": GammaCurve(1.0),
    "srgb": GammaCurve(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045),
    "g18": GammaCurve(1.8),
    "g22": GammaCurve(2.2),
    "g24": GammaCurve(2.4),
}

_NCLX = re.compile(rb"colrnclx(.{4})", re.DOTALL)

_NCLX_PRIMARIES = {1: "rec709", 2: "rec709", 9: "rec2020", 12: "p3d65"}
_NCLX_CURVES = {4: "g22", 8: "lin", 16: "pq", 18: "hlg"} | dict.fromkeys((1, 2, 6, 13, 14, 15), "srgb")
"""By ITU-T H.273. Curves of cameras for television are shown as sRGB; 2 is unspecified."""

_USUAL = ("srgb_rec709", "g22_rec709")
"""A gamma of 2.2 stands for sRGB, for programs that know nothing better (PNG, section 11.3.2.5)."""

_XYZ_ITSELF: Chromaticities = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0), (1 / 3, 1 / 3))


@dataclass(frozen=True, slots=True)
class Stated:
    """What a file that OpenImageIO reads says of itself.

    Attributes
    ----------
    orientation
        1 to 8, the place of row 0 and column 0 (Exif 2.32, tag 0x0112).
    profile
        Colours of its samples: an ICC profile's bytes, or a profile made of other statements; None: sRGB, or
        for floats linear sRGB.
    premultiplied
        Whether its colours are multiplied with alpha.
    unknown
        A colour coding that cannot be applied, as OpenImageIO names it; '' if there is none.
    """

    orientation: int
    profile: bytes | Profile | None
    premultiplied: bool
    unknown: str = ""


def stated(name: str, format_name: str, spec: ImageSpec) -> Stated:
    """Return what a file says of itself.

    Parameters
    ----------
    name
        The file.
    format_name, spec
        As OpenImageIO has them after opening it.
    """
    # PNG and WebP hold straight alpha, OpenEXR premultiplied; TIFF says which.
    straight = format_name in ("png", "webp") or spec.get_int_attribute("oiio:UnassociatedAlpha") == 1
    orientation = spec.get_int_attribute("Orientation", 0) or _xmp_orientation(name)
    premultiplied = spec.alpha_channel >= 0 and not straight
    data = spec.getattribute("ICCProfile")
    if data is not None:
        return Stated(orientation, np.asarray(data, np.uint8).tobytes(), premultiplied)
    if format_name == "openexr":
        return Stated(orientation, _exr_profile(spec), premultiplied)
    if format_name != "png":
        wide = spec.get_int_attribute("Exif:ColorSpace") == _UNCALIBRATED and _is_adobe_rgb(name)
        found = _coding("g22", "adobergb", spec.nchannels)[0] if wide else None
        return Stated(orientation, found, premultiplied)
    space = spec.get_string_attribute("oiio:ColorSpace", "srgb_rec709_scene")
    curve, _, primaries = space.rpartition("_")[0].partition("_")
    profile, unknown = _coding(curve, primaries, spec.nchannels)
    return Stated(orientation, profile, premultiplied, unknown)


def stated_in_heif(profile: bytes | None, head: bytes, channels: int) -> Stated:
    """Return what a HEIC or AVIF file says of itself; its library has turned it upright.

    Parameters
    ----------
    profile
        Its ICC profile.
    head
        The beginning of the file, with its description.
    channels
        Of its pixels.
    """
    codes = _NCLX.search(head)
    if profile is not None or codes is None:
        return Stated(1, profile, False)
    primaries, curve = unpack(">HH", codes[1])
    found, unknown = _coding(
        _NCLX_CURVES.get(curve, f"transfer{curve}"),
        _NCLX_PRIMARIES.get(primaries, f"primaries{primaries}"),
        channels,
    )
    return Stated(1, found, False, unknown)


def _coding(curve: str, primaries: str, channels: int) -> tuple[Profile | None, str]:
    """Return a named coding's profile, None if it is sRGB; and its name, if it is not known."""
    name = f"{curve}_{primaries}"
    if name in _USUAL or not primaries:
        return None, ""
    if curve not in _CURVES or primaries not in _PRIMARIES:
        return None, name
    if channels < 3:
        return Profile(name, "GRAY", False, (_CURVES[curve],)), ""
    return rgb_profile(name, _CURVES[curve], _PRIMARIES[primaries]), ""


def _xmp_orientation(name: str) -> int:
    with open(name, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        found = _XMP_ORIENTATION.search(data)
        return 1 if found is None else int(found[1])


def _is_adobe_rgb(name: str) -> bool:
    """Return whether a camera names Adobe RGB, as many do without a profile (DCF 2.0: Exif's R03)."""
    with open(name, "rb") as file:
        return _ADOBE_RGB.search(file.read(1 << 16)) is not None


def _exr_profile(spec: ImageSpec) -> Profile | None:
    """Return the colours of an OpenEXR file that states chromaticities.

    White stays neutral, or the stated neutral colour. Numbers that are X, Y and Z need no adaptation.
    """
    numbers = spec.getattribute("chromaticities")
    if numbers is None or len(numbers) != 8 or spec.nchannels < 3:
        return None
    places = [round(float(number), 6) for number in numbers]
    if not np.isfinite(places).all():
        return None
    pairs = list(zip(places[::2], places[1::2], strict=True))
    given: Chromaticities = (pairs[0], pairs[1], pairs[2], pairs[3])
    neutral = spec.getattribute("adoptedNeutral")
    if neutral is not None and len(neutral) == 2:
        white = (float(neutral[0]), float(neutral[1]))
    elif np.allclose(given, _XYZ_ITSELF, atol=1e-4):
        white = _PRIMARIES["rec709"][3]
    else:
        white = given[3]
    return rgb_profile("chromaticities", _CURVES["lin"], given, neutral=white)
