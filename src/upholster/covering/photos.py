"""Photos as files: the work of the commands ``upholster prepare`` and ``upholster fill``."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from upholster.base.errors import InputError
from upholster.base.examples import sample_path
from upholster.base.files import outputs, path_text
from upholster.base.options.choices import seed_number
from upholster.base.options.sample_options import SampleOptions
from upholster.base.types import PixelArray, Progress
from upholster.covering.notes import sample_notes
from upholster.image.color import alpha_channel, from_linear, to_linear
from upholster.image.drawing import Drawing
from upholster.image.files.read import read_image, read_photo
from upholster.image.files.source import Sample, Source
from upholster.image.files.write import IMAGE_SUFFIXES, write_image
from upholster.image.masks import as_alpha
from upholster.image.photo.perspective import proposed_corners
from upholster.image.resize import resize_image
from upholster.output.export.map_files import map_companion, write_map
from upholster.runtime.parallel import running
from upholster.synthesis.photo_fill import Filling, Hole, is_alpha

__all__ = ["FilledReport", "PreparedReport", "fill_files", "prepare_sample"]

_PICTURE_HEIGHT, _GAP = 512, 16
_WIDEST = 1024
_LINE = (1.0, 0.1, 0.6)


@dataclass(frozen=True, slots=True)
class PreparedReport:
    """Report of `prepare_sample`.

    Attributes
    ----------
    width, height, bits
        Size of the sample in pixels, and bits per channel.
    written
        Bytes of each file.
    notes
        Warnings and advice, in words.
    """

    width: int
    height: int
    bits: int
    written: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def prepare_sample(
    photo: str | os.PathLike[str],
    target: str | os.PathLike[str],
    options: SampleOptions,
    *,
    picture: str | os.PathLike[str] | None = None,
) -> PreparedReport:
    """Make a sample from a photo and write it, sRGB-coded, at the photo's depth if the format allows it.

    Parameters
    ----------
    photo
        The file, or the name of an included sample, see `upholster.read_exemplar`.
    target
        The image to write; its suffix sets the format.
    options
        How the photo is prepared; a mask becomes the sample's alpha.
    picture
        The file for a picture of photo and sample side by side, with the used part outlined.

    Raises
    ------
    InputError
        As for `upholster.image.files.read.read_photo`; for a mask and JPEG, which holds no alpha; for a file
        that can not be written, or is the photo. Then nothing is written.
    """
    targets = [target] if picture is None else [target, picture]
    for file in targets:
        if Path(file).suffix.lower() not in IMAGE_SUFFIXES:
            raise InputError(f"output {os.fspath(file)!r} is no image; allowed: {', '.join(IMAGE_SUFFIXES)}")
    if options.use is not None and IMAGE_SUFFIXES[Path(target).suffix.lower()] == "jpeg":
        raise InputError(f"output {os.fspath(target)!r} can not hold a mask; allowed: .png, .webp, .tif")
    photo = sample_path(photo)
    notes: list[str] = []
    with outputs(targets, inputs=[photo, *([options.mask] if options.mask else [])]) as files:
        sample, used = read_photo(photo, options, notes=notes)
        notes += _hints(sample, options)
        if used is not None:
            sample = as_alpha(sample, used)
            notes.append("the mask is the sample's alpha; for `upholster cover` add: --use alpha")
        write_image(files.path(target), sample, quality=95)
        if picture is not None:
            write_image(files.path(picture), _side_by_side(read_image(photo, notes=[]), sample, options))
        written = {os.fspath(file): files.path(file).stat().st_size for file in targets}
    height, width = sample.shape[:2]
    return PreparedReport(width, height, 8 * sample.itemsize, written, notes)


@dataclass(frozen=True, slots=True)
class FilledReport:
    """Report of `fill_files`.

    Attributes
    ----------
    width, height, bits
        Size of the photo in pixels, and bits per channel.
    filled
        Number of new pixels.
    written
        Bytes of each file.
    notes
        Warnings and advice, in words.
    """

    width: int
    height: int
    bits: int
    filled: int
    written: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def fill_files(
    photo: Source | Sample,
    hole: Hole,
    target: str | os.PathLike[str],
    *,
    sample: Source | Sample | None = None,
    block: int | None = None,
    seed: int | None = 0,
    progress: Progress | None = None,
) -> FilledReport:
    """Fill a hole and write the result; a material's other maps are written next to it, named by role.

    Parameters
    ----------
    target
        The image to write; its suffix sets the format.
    photo, hole, sample, block, seed, progress
        As for `upholster.fill`.

    Raises
    ------
    InputError
        As for `upholster.fill`; for a file that cannot be written, or is an input. Then nothing is written.
    """
    if Path(path_text(target, "output")).suffix.lower() not in IMAGE_SUFFIXES:
        raise InputError(f"output {os.fspath(target)!r} is no image; allowed: {', '.join(IMAGE_SUFFIXES)}")
    seed = seed_number(seed)
    read = [*Sample.of(photo).files, *([] if sample is None else Sample.of(sample).files)]
    if isinstance(hole, (str, os.PathLike)) and not is_alpha(hole):
        read.append(os.fspath(hole))
    notes: list[str] = []
    with running(progress=progress), outputs([target], inputs=read) as files:
        filling = Filling.of(photo, hole, sample, block, notes)
        places = {role: map_companion(target, role) for role in filling.maps} | {"albedo": Path(target)}
        files.add(places.values())
        maps = filling.filled(seed)
        for role, pixels in maps.items():
            write_map(files.path(places[role]), role, pixels, quality=95)
        written = {os.fspath(place): files.path(place).stat().st_size for place in places.values()}
    if not all(_holds(places[role], pixels) for role, pixels in maps.items()):
        notes.append(f"{Path(target).suffix} does not hold all of the photo to the bit; .tif does")
    height, width = filling.hole.shape
    count = int(np.count_nonzero(filling.hole))
    return FilledReport(width, height, 8 * maps["albedo"].itemsize, count, written, notes)


def _holds(place: Path, pixels: PixelArray) -> bool:
    # Whether a format stores all samples exactly.
    suffix = place.suffix.lower()
    if suffix == ".exr":
        return pixels.dtype.kind == "f" and alpha_channel(pixels.shape[2]) is None
    return suffix in (".tif", ".tiff") or (suffix == ".png" and pixels.dtype.kind != "f")


def _hints(sample: PixelArray, options: SampleOptions) -> list[str]:
    """Return advice on useful options."""
    found = sample_notes(sample)
    if options.rectify is None and options.crop is None and options.resize is None:
        corners = proposed_corners(sample)
        if corners is not None:
            words = " ".join(f"{x:.0f},{y:.0f}" for x, y in corners)
            found.append(f"it was taken at an angle, it seems; --rectify {words} shows it from the front")
    return found


def _side_by_side(photo: PixelArray, sample: PixelArray, options: SampleOptions) -> PixelArray:
    height, width = photo.shape[:2]
    left, right = _shown(photo), _shown(sample)
    drawing = Drawing(left.shape[1] + _GAP + right.shape[1], _PICTURE_HEIGHT)
    drawing.paste(0, 0, left)
    drawing.paste(left.shape[1] + _GAP, 0, right)
    outline: list[tuple[float, float]] = []
    if options.rectify is not None:
        outline = [(float(x), float(y)) for x, y in options.rectify]
    elif options.crop is not None:
        x, y, w, h = options.crop
        outline = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
    if outline:
        scale = np.array([left.shape[1] / width, left.shape[0] / height])
        edge = np.array([left.shape[1], left.shape[0]]) - 2
        points = [tuple(np.clip(np.array(point) * scale, 1, edge).tolist()) for point in outline]
        drawing.lines([*points, points[0]], color=_LINE, width=3)
    return drawing.pixels()


def _shown(pixels: PixelArray) -> PixelArray:
    """Return a picture of one height, 8-bit RGB, over white."""
    height, width = pixels.shape[:2]
    wide = min(_WIDEST, max(1, round(width * _PICTURE_HEIGHT / height)))
    tall = max(1, min(_PICTURE_HEIGHT, round(height * wide / width)))
    linear = to_linear(resize_image(pixels, height=tall, width=wide))
    if linear.shape[2] in (2, 4):
        linear = linear[:, :, :-1] * linear[:, :, -1:] + 1 - linear[:, :, -1:]
    colors: PixelArray = from_linear(
        np.repeat(linear, 3, axis=2) if linear.shape[2] == 1 else linear, np.uint8
    )
    return colors
