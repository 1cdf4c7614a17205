"""A stream's sample: each map is coded once, and kept on disk for other streams of the same sample."""

from collections.abc import Iterable, Mapping
from hashlib import blake2b
from typing import Any

from upholster.codec import CodedImage, check_image, encode_parts
from upholster.disk_cache import kept_on_disk
from upholster.stages import stage
from upholster.types import PixelArray

__all__ = ["coded_maps", "sample_errors"]


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
