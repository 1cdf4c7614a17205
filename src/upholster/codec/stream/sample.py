"""A stream's sample: each map is coded once, and kept on disk for other streams of the same sample."""

import math
from collections.abc import Iterable, Mapping
from hashlib import blake2b
from typing import Any

from upholster.base.types import PixelArray
from upholster.codec.header import MAX_SAMPLES
from upholster.codec.image_code import CodedImage, check_image, encode_parts
from upholster.codec.stream.maps import MAX_MAP_SAMPLES
from upholster.runtime.disk_cache import kept_on_disk
from upholster.runtime.stages import stage

__all__ = ["coded_maps", "fitting_side", "sample_errors"]

_ROOM = 0.94
"""Part of the allowed samples that a reduced sample has: the coder pads rows and columns."""


def fitting_side(maps: Iterable[PixelArray]) -> int | None:
    """Return the longer side in pixels to which maps must be resized to fit in a stream; None: they fit.

    Parameters
    ----------
    maps
        (H, W, C) arrays of one height and width.
    """
    shapes = [image.shape for image in maps]
    height, width = shapes[0][:2]
    channels = [shape[2] for shape in shapes]
    most = min(MAX_SAMPLES // max(channels), MAX_MAP_SAMPLES // sum(channels))
    if height * width <= most:
        return None
    return int(max(height, width) * math.sqrt(_ROOM * most / (height * width)))


def coded_maps(
    exemplar: PixelArray, maps: Mapping[str, PixelArray], *, most_significant: int | None, **how: Any
) -> tuple[CodedImage, dict[str, CodedImage]]:
    """Return a sample and its further maps, coded.

    Parameters
    ----------
    exemplar, maps
        As for `encode_stream`, checked.
    most_significant
        Limit of the exemplar's coefficients; the other maps have no such limit.
    how
        Options of `check_image` and `encode_parts`.

    Raises
    ------
    InputError
        For an image or options that do not fit.
    """
    for image in (exemplar, *maps.values()):
        check_image(image, **how)
    first = _coded(exemplar, most_significant=most_significant, **how)
    return first, {role: _coded(image, **how) for role, image in maps.items()}


def sample_errors(coded: CodedImage, lengths: Iterable[int]) -> tuple[float, dict[int, float]]:
    """Return a sample's mean squared error before its stream, and after given numbers of its bytes."""
    return coded.errors[0], {length: coded.error(length) for length in lengths}


@stage
def _coded(image: PixelArray, **how: Any) -> CodedImage:
    content = blake2b(image.tobytes()).hexdigest(), image.shape, image.dtype.name
    return kept_on_disk(("sample", *content, sorted(how.items())), lambda: encode_parts(image, **how))
