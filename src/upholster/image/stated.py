"""What image files say of themselves, and what is done with it: orientation, colours, alpha, depth, gain map.

`STATEMENTS` lists all of it; docs/photos.md has the same table. The functions below read what OpenImageIO
passes on. `upholster.image.heif` reads HEIC and AVIF, whose libraries apply most of it themselves.
"""

import mmap
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from OpenImageIO import ImageSpec

from upholster.image.icc import Chromaticities, GammaCurve, Profile, rgb_profile

__all__ = ["STATEMENTS", "Stated", "Statement", "stated"]


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
    Statement("HEIC", "depth: 10 or 12 bits", "scaled to 16 bits"),
    Statement("AVIF", "depth: 10 or 12 bits", "read at 8 bits, with a note"),
    Statement("all", "several images", "the first or main one is read"),
)
"""What is not listed, such as the camera, the place or the resolution, changes no pixel and is ignored."""

_XMP_ORIENTATION = re.compile(rb"tiff:Orientation\s*(?:=\s*[\"']|>)\s*([1-8])")

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
        return Stated(orientation, None, premultiplied)
    space = spec.get_string_attribute("oiio:ColorSpace", "srgb_rec709")
    curve, _, primaries = space.rpartition("_")[0].partition("_")
    if f"{curve}_{primaries}" in _USUAL or not primaries:
        return Stated(orientation, None, premultiplied)
    if curve not in _CURVES or primaries not in _PRIMARIES:
        return Stated(orientation, None, premultiplied, space)
    profile: Profile | None = Profile(space, "GRAY", False, (_CURVES[curve],))
    if spec.nchannels >= 3:
        profile = rgb_profile(space, _CURVES[curve], _PRIMARIES[primaries])
    return Stated(orientation, profile, premultiplied)


def _xmp_orientation(name: str) -> int:
    with open(name, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        found = _XMP_ORIENTATION.search(data)
        return 1 if found is None else int(found[1])


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
