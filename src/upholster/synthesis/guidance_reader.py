"""Turns the texts of options into guidance: reads maps of the sample, joins samples of zones in one image."""

import os
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.guide_texts import GuideText, PutText, parse_again, parse_guide, parse_put, parse_zone
from upholster.base.lengths import parse_length, read_length
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import IntArray, PixelArray
from upholster.charts.directions.direction_image import is_direction_image
from upholster.charts.directions.strokes import is_stroke_file
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import SurfaceMap
from upholster.charts.size_map import parse_size_map
from upholster.image.color import alpha_channel
from upholster.image.files.collage import Rectangle, combined
from upholster.image.files.material import Material
from upholster.image.files.read import read_image
from upholster.image.files.source import Sample, read_source, source_parts
from upholster.image.masks import as_map, is_white
from upholster.image.numbers import to_unit
from upholster.image.photo.preparation import MAX_SIDE, MIN_SIDE, cut_out, finished, resampled
from upholster.image.roles import ROLES
from upholster.runtime.stages import file_stage
from upholster.synthesis.exemplar import NO_GUIDANCE, Guidance, Guide, Put
from upholster.synthesis.quilt.steering import MOST_ZONES, as_guide

__all__ = ["guidance_files", "placement_options", "read_guidance", "sized_sample", "with_names"]

_GUIDED = ("guide", "labels", "zone", "again", "put")

_LUMINANCE = "luminance"
"""The word for the luminance of the sample's colours."""

_MOST_LABELS = 254

MIN_PIECE = 8
"""Minimum height and width, in pixels, of a piece of the sample that the user puts at a place."""

_SMOOTH = 64
"""Where the sample itself is the guide, it is averaged within this fraction, 1/64, of its shorter side."""

_TAILS = 0.02
"""Where the sample itself is the guide, this fraction of all pixels becomes 0, and the same fraction 1."""


def placement_options(asked: SynthesisOptions) -> list[str]:
    """Return the names of the placement options that the user gave."""
    return [option for option in _GUIDED if getattr(asked, option)]


def guidance_files(asked: SynthesisOptions) -> list[str]:
    """Return the files named in guides, labels, zones, regions and pieces."""
    found: list[str] = []
    for guide in map(parse_guide, (*(asked.guide or ()), *(asked.labels or ()))):
        found += [] if _is_word(guide.sample) else [guide.sample]
        found += parse_map(guide.target).files
    for zone in map(parse_zone, asked.zone or ()):
        sample = sized_sample(zone.sample, f"zone {str(zone)!r}")
        found += [*sample.folders, *sample.files, *parse_map(zone.target).files]
    for text in asked.again or ():
        found += parse_map(parse_again(text).region).files
    for put in map(parse_put, asked.put or ()):
        if isinstance(put.piece, str):
            found += sized_sample(put.piece, f"put {put.piece!r}").files
    return list(dict.fromkeys(found))


def with_names(asked: SynthesisOptions, name: Callable[[str], str]) -> SynthesisOptions:
    """Return the options with other names of files; `name` returns a file's."""

    def map_(text: str) -> str:
        return parse_map(text).named(name)

    def sample(text: str) -> str:
        own = sized_sample(text, "sample")
        return name(str(own.source)) + ("" if own.size is None else f"@{own.size}")

    def guide(text: GuideText) -> str:
        own = text.sample if _is_word(text.sample) else name(text.sample)
        return str(replace(text, sample=own, target=map_(text.target)))

    zones = [parse_zone(text) for text in asked.zone or ()]
    puts = [parse_put(text) for text in asked.put or ()]
    again = [parse_again(text) for text in asked.again or ()]
    found: dict[str, list[str]] = {
        "stroke": [name(text) if is_stroke_file(text) else text for text in asked.stroke or ()],
        "guide": [guide(parse_guide(text)) for text in asked.guide or ()],
        "labels": [guide(parse_guide(text)) for text in asked.labels or ()],
        "zone": [str(replace(one, sample=sample(one.sample), target=map_(one.target))) for one in zones],
        "again": [str(replace(one, region=map_(one.region))) for one in again],
        "put": [
            str(replace(one, piece=sample(one.piece)) if isinstance(one.piece, str) else one) for one in puts
        ],
    }
    changes: dict[str, Any] = {option: tuple(texts) for option, texts in found.items() if texts}
    if is_direction_image(asked.direction):
        changes["direction"] = name(asked.direction.strip())
    if asked.size_map is not None:
        changes["size_map"] = parse_size_map(asked.size_map).named(name)
    return replace(asked, **changes)


def sized_sample(text: str, what: str) -> Sample:
    """Return a sample from a file name, optionally with its width after an @: ``oak.jpg@30cm``.

    Raises
    ------
    InputError
        If there is no file before the @, or no length after it.
    """
    file, at, size = text.rpartition("@")
    # The @ belongs to the file's name if that file exists, or if a suffix follows the @.
    if not at or os.path.exists(text) or (re.search(r"\.[a-zA-Z]", size) and "/" not in size):
        return Sample(text)
    if not file:
        raise InputError(f"{what} is {text!r}; allowed: a file before the @")
    read_length(size, name=f"size of the {what}")
    return Sample(file, size)


def _inputs(_: object, asked: SynthesisOptions, *__: object) -> list[str]:
    return guidance_files(asked)


@file_stage(_inputs)
def read_guidance(
    asked: SynthesisOptions,
    source: PixelArray | Material,
    reading: SampleOptions,
    metres: float | None,
) -> tuple[PixelArray | Material, Guidance]:
    """Return the image to paint from, which includes the samples of zones, and all placement requests.

    Parameters
    ----------
    asked
        The options.
    source, reading
        The sample, and how it was read: guides are read in the same way.
    metres
        Length of a model unit; None: unknown.

    Raises
    ------
    InputError
        If a text is invalid, a file cannot be read, or a map differs from the sample in size.
    """
    if not placement_options(asked):
        return source, NO_GUIDANCE
    guides = [_guide(parse_guide(text), source, reading) for text in asked.guide or ()]
    labels = [parse_guide(text, "labels") for text in asked.labels or ()]
    guides += [_guide(text, source, reading, labels=True) for text in labels]
    again = tuple(_again(text, number) for number, text in enumerate(asked.again or (), 1))
    zones, puts = list(map(parse_zone, asked.zone or ())), list(map(parse_put, asked.put or ()))
    if len(zones) >= MOST_ZONES:
        raise InputError(f"there are {len(zones)} zones; allowed: up to {MOST_ZONES - 1}")
    own = source if isinstance(source, Material) else Material({"albedo": source})
    shape = own.shape
    others = [_other(zone.sample, "zone", shape[1], asked, metres) for zone in zones]
    files = [put.piece for put in puts if isinstance(put.piece, str)]
    others += [_other(file, "put", shape[1], asked, metres) for file in files]
    if not others:
        placed = tuple(_put(put, shape, None, None) for put in puts)
        return source, Guidance(tuple(guides), again=again, put=placed)
    whole, rectangles = combined([own, *others])
    pieces = iter(zip(rectangles[1 + len(zones) :], others[len(zones) :], strict=True))
    placed = tuple(
        _put(put, shape, *(next(pieces) if isinstance(put.piece, str) else (None, None))) for put in puts
    )
    wanted = tuple(parse_map(zone.target) for zone in zones)
    blend = None if asked.blend is None else parse_length(asked.blend, metres, name="blend")
    guides = [replace(one, shown=_widened(one.shown, whole.shape, rectangles[0])) for one in guides]
    return whole, Guidance(tuple(guides), rectangles[: 1 + len(zones)], wanted, blend, again, placed)


def _put(put: PutText, shape: tuple[int, int], rectangle: Rectangle | None, material: Material | None) -> Put:
    # A piece of the sample, or a separate sample, with its rectangle in the image.
    if isinstance(put.piece, str):
        assert rectangle is not None
        assert material is not None
        return Put(str(put), rectangle, put.place, put.size, put.degrees, material.used)
    x, y, width, height = put.piece
    text = ",".join(map(str, put.piece))
    if width < MIN_PIECE or height < MIN_PIECE or x + width > shape[1] or y + height > shape[0]:
        raise InputError(
            f"put {text!r} is not part of the sample; allowed: x,y,width,height inside "
            f"{shape[1]}x{shape[0]}, {MIN_PIECE} pixels or more each way"
        )
    return Put(str(put), (y, x, height, width), put.place, put.size, put.degrees)


def _again(text: str, number: int) -> tuple[SurfaceMap, int]:
    # The n-th region that is laid again has seed n, unless the user gives a seed.
    again = parse_again(text)
    return parse_map(again.region), number if again.seed is None else again.seed


def _other(text: str, what: str, width: int, asked: SynthesisOptions, metres: float | None) -> Material:
    # Another sample, resampled to the scale of the first one, which is `width` pixels wide. The alpha of a
    # sample that the user puts at a place is its outline.
    sample = sized_sample(text, what)
    found = read_source(sample)
    pixels = found.maps["albedo"] if isinstance(found, Material) else found
    if what == "put" and alpha_channel(pixels.shape[2]) is not None:
        found = read_source(replace(sample, options=SampleOptions(use="alpha")))
    material = found if isinstance(found, Material) else Material({"albedo": found})
    if sample.size is None:
        return material
    if asked.sample_size is None:
        raise InputError(f"{what} {text!r} has a size but the sample has none; allowed: with --sample-size")
    own, wanted = (
        parse_length(size, metres, name=name)
        for size, name in ((asked.sample_size, "sample size"), (sample.size, f"size of {what} {text!r}"))
    )
    by = width / own * wanted / material.shape[1]
    height, width = (max(1, round(by * side)) for side in material.shape)
    if not all(MIN_SIDE <= side <= MAX_SIDE for side in (height, width)):
        raise InputError(
            f"{what} {text!r} has {width}x{height} pixels at the sample's scale; "
            f"allowed: {MIN_SIDE} to {MAX_SIDE} each way"
        )
    size: dict[str, Any] = {"height": height, "width": width}
    maps = {role: resampled(role, pixels, **size) for role, pixels in material.maps.items()}
    if material.used is None:
        return Material(maps)
    return Material(maps, used=is_white(resampled("used", as_map(material.used), **size)))


def _widened(shown: NDArray[np.uint8], shape: tuple[int, int], own: Rectangle) -> NDArray[np.uint8]:
    # A guide of the first sample, extended to the image of all samples. The other samples' pixels get the
    # value of its first pixel; guides do not apply to them.
    out = np.full(shape, shown[0, 0], np.uint8)
    out[: own[2], : own[3]] = shown
    return out


def _is_word(name: str) -> bool:
    return name.lower() in (_LUMINANCE, *ROLES[1:])


def _guide(
    text: GuideText, source: PixelArray | Material, reading: SampleOptions, *, labels: bool = False
) -> Guide:
    parts = source_parts(source)
    shape = parts["albedo"].shape[:2]
    codes: IntArray | None = None
    if _is_word(text.sample):
        if labels:
            raise InputError(f"labels {str(text)!r}: {text.sample} has no labels; allowed: an image's file")
        shown = _own(text, parts)
    else:
        pixels = _prepared(text, reading, labels=labels)
        if pixels.shape[:2] != shape:
            what, (height, width) = "image of labels" if labels else "guide", pixels.shape[:2]
            raise InputError(
                f"{what} {text.sample!r} is {width}x{height} pixels; "
                f"allowed: {shape[1]}x{shape[0]}, like the sample"
            )
        if labels:
            codes, shown = _numbered(text, pixels)
        else:
            shown = as_guide(_grey(pixels))
    return Guide(str(text), shown, parse_map(text.target), text.weight, codes)


def _numbered(text: GuideText, pixels: PixelArray) -> tuple[IntArray, NDArray[np.uint8]]:
    # The colours of an image of labels, and the number of each pixel's colour, from 1.
    known, shown = np.unique(_codes(pixels), return_inverse=True)
    if len(known) > _MOST_LABELS:
        raise InputError(
            f"labels {str(text)!r}: the sample's map has {len(known):,} colours; "
            f"allowed: up to {_MOST_LABELS}, in a PNG without smooth edges"
        )
    return known, (shown.reshape(pixels.shape[:2]) + 1).astype(np.uint8)


def _prepared(text: GuideText, reading: SampleOptions, *, labels: bool) -> PixelArray:
    # A map of the sample, prepared like the photo: rectified, cropped, resized. Its light is not evened.
    pixels = read_image(text.sample, colors=False)
    if labels and (reading.rectify is not None or reading.resize is not None):
        raise InputError(
            f"labels {str(text)!r} with rectify or resize, which would mix colours; "
            "allowed: labels of a sample that `upholster prepare` made"
        )
    maps = cut_out({"albedo": pixels, "guide": pixels}, reading)
    if labels and max(maps["guide"].shape[:2]) > MAX_SIDE:
        raise InputError(
            f"labels {str(text)!r} have more than {MAX_SIDE} pixels a side, and reducing them would mix "
            "colours; allowed: a sample of this size, or a part of it (--crop)"
        )
    # The sample's own note says if it was reduced.
    return finished(maps, reading.of_guides, [])["guide"]


def _own(text: GuideText, parts: dict[str, PixelArray]) -> NDArray[np.uint8]:
    # A map of the sample itself as a guide: smoothed, and stretched to the range 0…1.
    role = "albedo" if text.sample.lower() == _LUMINANCE else text.sample.lower()
    if role not in parts:
        raise InputError(
            f"guide {str(text)!r}: the sample has no {role}; allowed: "
            f"{', '.join((_LUMINANCE, *(name for name in parts if name != 'albedo')))}, or an image's file"
        )
    plane = _grey(parts[role]).astype(np.float64)
    for _ in range(2):
        for axis in (0, 1):
            plane = _box_mean(plane, max(1, min(plane.shape) // _SMOOTH), axis)
    low, high = np.quantile(plane, [_TAILS, 1 - _TAILS])
    return as_guide(np.asarray(np.clip((plane - low) / max(high - low, 1e-9), 0.0, 1.0), np.float32))


def _box_mean(plane: NDArray[np.float64], radius: int, axis: int) -> NDArray[np.float64]:
    pad = [(radius + 1, radius) if n == axis else (0, 0) for n in (0, 1)]
    sums = np.cumsum(np.pad(plane, pad, mode="edge"), axis=axis)
    size, width = plane.shape[axis], 2 * radius + 1
    means: NDArray[np.float64] = (
        np.take(sums, range(width, width + size), axis) - np.take(sums, range(size), axis)
    ) / width
    return means


def _grey(pixels: PixelArray) -> NDArray[np.float32]:
    plain = pixels[:, :, : alpha_channel(pixels.shape[2])]
    return np.asarray(to_unit(plain).mean(axis=2), np.float32)


def _codes(pixels: PixelArray) -> IntArray:
    # 0xRRGGBB.
    plain = np.rint(255 * to_unit(pixels[:, :, : alpha_channel(pixels.shape[2])])).astype(np.int32)
    red, green, blue = (plain[:, :, min(k, plain.shape[2] - 1)] for k in range(3))
    found: IntArray = red << 16 | green << 8 | blue
    return found
