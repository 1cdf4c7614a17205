"""From a photo to a sample: rectify, crop, resize, even the light. A material's maps are treated alike."""

import re
from collections.abc import Mapping

import numpy as np

from upholster.base.errors import InputError
from upholster.base.options.sample_options import SampleOptions
from upholster.base.types import FloatArray, PixelArray
from upholster.base.vectors import unit_vectors
from upholster.image.color import from_linear
from upholster.image.numbers import as_depth, to_unit
from upholster.image.photo.even_light import even_light
from upholster.image.photo.rectify import Rectification
from upholster.image.profiles import Notes, tell
from upholster.image.resize import resize_image
from upholster.image.roles import COLORS

__all__ = [
    "MAX_SIDE",
    "MIN_SIDE",
    "check_crop",
    "check_resize",
    "cut_out",
    "finished",
    "resampled",
    "unit_normal_map",
]

MIN_SIDE, MAX_SIDE = 32, 4096
"""Sides of an exemplar in pixels."""

_MOST_RECTIFIED = 16384

Maps = dict[str, PixelArray]


def cut_out(maps: Mapping[str, PixelArray], options: SampleOptions) -> Maps:
    """Return the requested part of a photo, or of a material's maps by role: rectified and cropped.

    Parameters
    ----------
    maps
        (H, W, C) arrays of one height and width by role; a photo has the role "albedo".
    options
        The requested changes; a crop is in pixels of the rectified photo.

    Raises
    ------
    InputError
        If corners or crop are outside the photo or malformed.
    """
    height, width = maps["albedo"].shape[:2]
    if options.rectify is not None:
        rectification = Rectification(options.rectify, width, height)
        width, height = rectification.width, rectification.height
        if max(width, height) > _MOST_RECTIFIED or min(width, height) < 1:
            raise InputError(
                f"rectify gives {width}x{height} pixels; allowed: up to {_MOST_RECTIFIED} each way"
            )
        maps = {role: _rectified(role, pixels, rectification) for role, pixels in maps.items()}
    if options.crop is not None:
        x, y, w, h = _checked_crop(options.crop, width, height)
        maps = {role: pixels[y : y + h, x : x + w] for role, pixels in maps.items()}
    return dict(maps)


def finished(maps: Mapping[str, PixelArray], options: SampleOptions, notes: Notes | None = None) -> Maps:
    """Return a sample's maps in the requested size; even light is for the albedo alone.

    Without a requested size, maps that are too large are reduced to the largest size.

    Parameters
    ----------
    maps, options
        `maps` is the result of `cut_out`.
    notes
        Gets a note if they are reduced without request; without a list it becomes a warning.

    Raises
    ------
    InputError
        If the size is outside 32 to 4096.
    """
    result = dict(maps)
    target = check_resize(options.resize)
    height, width = next(iter(maps.values())).shape[:2]
    reduced = target is None and max(height, width) > MAX_SIDE
    if reduced:
        target = MAX_SIDE
    if target is not None:
        if isinstance(target, int):
            longer = max(height, width)
            target = (max(1, round(width * target / longer)), max(1, round(height * target / longer)))
        if not all(MIN_SIDE <= side <= MAX_SIDE for side in target):
            raise InputError(
                f"resize gives {target[0]}x{target[1]} pixels; allowed: {MIN_SIDE} to {MAX_SIDE} each way"
            )
        if reduced:
            tell(
                notes,
                f"the sample has {width}x{height} pixels and was reduced to {target[0]}x{target[1]}: up to "
                f"{MAX_SIDE} each way are used; --crop takes a part at full size",
            )
        result = {
            role: resampled(role, pixels, height=target[1], width=target[0]) for role, pixels in maps.items()
        }
    if _flag("even light", options.even_light):
        result["albedo"] = even_light(result["albedo"])
    return result


def resampled(role: str, pixels: PixelArray, *, height: int, width: int) -> PixelArray:
    """Resize a map: colours in linear light, others as plain numbers, normals normalized again."""
    if pixels.shape[:2] == (height, width):
        return pixels
    if role in COLORS:
        return resize_image(pixels, height=height, width=width)
    unit = resize_image(to_unit(pixels).astype(np.float32), height=height, width=width)
    return _from_unit(role, unit, pixels)


def unit_normal_map(pixels: PixelArray) -> PixelArray:
    """Return a normal map whose vectors have length 1."""
    return _from_unit("normal", to_unit(pixels).astype(np.float32), pixels)


def check_resize(resize: int | str | tuple[int, int] | None) -> int | tuple[int, int] | None:
    """Return the longer side, or (width, height); None if no size is given.

    Raises
    ------
    InputError
        If it is malformed or outside 32 to 4096.
    """
    if resize is None:
        return None
    if isinstance(resize, str):
        match = re.fullmatch(r"(\d{1,6})(?:[x×](\d{1,6}))?", resize.strip())
        if match is None:
            raise InputError(f"resize is {resize!r}; allowed: 256 (longer side) or 256x128 (width x height)")
        resize = int(match[1]) if match[2] is None else (int(match[1]), int(match[2]))
    sides = (resize,) if isinstance(resize, (int, np.integer)) else resize
    if not (_whole_numbers(sides, 1) or _whole_numbers(sides, 2)):
        raise InputError(f"resize is {resize!r}; allowed: one or two whole numbers")
    for side in sides:
        if not MIN_SIDE <= side <= MAX_SIDE:
            raise InputError(f"resize is {side}; allowed: {MIN_SIDE} to {MAX_SIDE}")
    return (int(sides[0]), int(sides[1])) if len(sides) == 2 else int(sides[0])


def check_crop(crop: object) -> None:
    """Raise InputError unless a crop is None or four whole numbers."""
    if crop is not None and not _whole_numbers(crop, 4):
        raise InputError(f"crop is {crop!r}; allowed: four whole numbers x, y, width, height")


def _checked_crop(crop: object, columns: int, rows: int) -> tuple[int, int, int, int]:
    check_crop(crop)
    x, y, width, height = (int(number) for number in crop)  # type: ignore[attr-defined]  # a tuple or list
    if x < 0 or y < 0 or width < 1 or height < 1 or x + width > columns or y + height > rows:
        raise InputError(
            f"crop is {x},{y},{width},{height}; allowed: x,y,width,height inside {columns}x{rows}"
        )
    return x, y, width, height


def _whole_numbers(values: object, count: int) -> bool:
    return (
        isinstance(values, (tuple, list))
        and len(values) == count
        and all(isinstance(value, (int, np.integer)) for value in values)
    )


def _flag(name: str, value: object) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is a {type(value).__name__}; allowed: True or False")
    return bool(value)


def _rectified(role: str, pixels: PixelArray, rectification: Rectification) -> PixelArray:
    if role in COLORS:
        return from_linear(rectification.apply(pixels), pixels.dtype)
    unit = rectification.apply(to_unit(pixels).astype(np.float32))
    if role == "normal":
        unit = ((_stretched(2.0 * unit - 1.0, rectification) + 1.0) / 2.0).astype(np.float32)
    return _from_unit(role, unit, pixels)


def _stretched(normals: PixelArray, rectification: Rectification) -> FloatArray:
    """Return normals as they are on the relief when it is stretched with the map.

    Slopes change with the derivatives of the rectification, Jᵀ∇h. Heights are scaled by the overall mean
    scale, so that a change of size alone leaves the normals as they are.
    """
    derivative = rectification.derivative()
    scale = np.sqrt(np.linalg.det(derivative).mean())
    # Slopes of the relief to the right and down; y of a normal map points up.
    x, y, z = np.moveaxis(normals.astype(np.float64), 2, 0)
    right, down = -x, y
    turned = np.stack(
        [
            -(derivative[..., 0, 0] * right + derivative[..., 1, 0] * down) / scale,
            (derivative[..., 0, 1] * right + derivative[..., 1, 1] * down) / scale,
            z,
        ],
        axis=2,
    )
    return unit_vectors(turned, least=1e-6)


def _from_unit(role: str, unit: PixelArray, like: PixelArray) -> PixelArray:
    """Return numbers 0…1 at the depth of a map; normals are normalized again."""
    if role == "normal":
        unit = unit_vectors(2 * unit - 1, least=1e-6) / 2 + 0.5
    return as_depth(unit.astype(np.float32), like.dtype)
