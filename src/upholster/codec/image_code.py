"""Whole images to header and stream, and the error of any prefix of the stream."""

import math
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError, check_whole
from upholster.base.options.write_options import Quality, check_quality
from upholster.base.types import MAX_SAMPLE, PixelArray
from upholster.codec.coder import MAX_PLANE, CoefficientEncoder
from upholster.codec.color_transforms import fit_klt, to_ycocg
from upholster.codec.header import MAX_PLACES, MAX_SAMPLES, ImageHeader
from upholster.codec.lifting import MAX_LEVELS, WAVELETS, Wavelet, forward
from upholster.codec.partial_image import PartialImage, tree_of, unweight, window
from upholster.codec.thresholds import share_thresholds, to_coded
from upholster.codec.tree import Tree, tree_size

__all__ = ["CodedImage", "check_image", "encode_parts"]

_PEAK = {"uint8": 255.0, "uint16": 65535.0, "float32": 65535.0 / 12.92}
"""The reference of errors. Floats are linear light: in the dark sRGB magnifies their errors 12.92 times."""

_FIRST_REST, _GROWTH, _LEAST_GROWTH = 100, 1.5, 1.01
"""Lengths at which errors are measured: the first, and the largest and smallest ratio to the next."""


@dataclass(frozen=True)
class CodedImage:
    """A coded image.

    Attributes
    ----------
    header
        The header (`ImageHeader`), as bytes.
    payload
        The stream; any prefix of it decodes.
    lengths, errors
        The mean squared error of the decoded integers after this many bytes of the stream, from 0 to all.
    peak
        The reference of errors for a PSNR.
    """

    header: bytes
    payload: bytes
    lengths: tuple[int, ...]
    errors: tuple[float, ...]
    peak: float

    def error(self, length: int) -> float:
        """Return the mean squared error after so many bytes: an upper bound between the measured lengths."""
        return float(np.interp(length, self.lengths, self.errors))

    def psnr(self, length: int) -> float:
        """Return the same in dB; infinite if nothing is lost."""
        error = self.error(length)
        return 10 * math.log10(self.peak**2 / error) if error > 0 else math.inf


def encode_parts(
    image: PixelArray,
    *,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
    sample_quality: Quality | None = None,
    most_bytes: int | None = None,
    most_significant: int | None = None,
) -> CodedImage:
    """Encode an image.

    Parameters
    ----------
    image
        (H, W, C), 1×1 or larger, at most 3.2 million samples; uint8, uint16, or float32, which is coded as
        16-bit integers over its range.
    wavelet
        "9/7" (default), "5/3" (default if lossless) or "haar" (the paper's profile: every channel on its own,
        the largest coefficients first).
    levels
        0 to 10; by default three for "haar", otherwise as many as leave the approximation about 4 samples
        wide, at most 6.
    sample_quality
        Stop at this PSNR, 20 to 80 dB, over all channels, relative to the largest integer; for floats, which
        are linear light, relative to their range divided by 12.92. Or "lossless": every sample is restored
        exactly, which requires "5/3" or "haar". None: stop at the last plane.
    most_bytes
        Largest length of header and stream together.
    most_significant
        Stop when this many coefficients have become significant.

    Returns
    -------
    CodedImage
        Header, stream and errors.

    Raises
    ------
    InputError
        For an image or options that do not fit.
    """
    wavelet = check_image(image, wavelet=wavelet, levels=levels, sample_quality=sample_quality)
    height, width, channels = image.shape
    levels = _levels(wavelet, height, width) if levels is None else levels
    if (places := tree_size(height, width, channels, levels)) > MAX_PLACES:
        raise InputError(
            f"image of {channels} channels is too thin for {levels} levels: "
            f"{places:,} places with padding; allowed: {MAX_PLACES:,}"
        )
    samples, low, high = _integers(image)
    planes, means, matrix = _planes(samples, wavelet, 128 if image.dtype == np.uint8 else 32768)
    coefficients = forward(planes, wavelet=wavelet, levels=levels)
    header = ImageHeader(
        height, width, channels, image.dtype, wavelet, levels, -1, _fineness(wavelet, coefficients), matrix,
        wavelet == "5/3" and channels >= 3, tuple(int(mean) for mean in means), low, high,
    )  # fmt: skip
    tree = tree_of(header)
    values, thresholds = _quantized(coefficients, header, tree)
    if np.abs(values).max() >> (MAX_PLANE + 1):
        # Only 16-bit samples can overflow, and only with more levels than the default.
        raise InputError(f"levels is {levels}: coefficients of 16-bit samples overflow; allowed: 0 to 6")
    encoder = CoefficientEncoder(values, tree, exact=header.exact)
    header = replace(header, plane=encoder.plane, thresholds=thresholds)
    peak = _PEAK[image.dtype.name]
    goal = _Goal(
        # Lossless continues to the last plane as well: an earlier end may suffice, but lacks coefficients.
        peak**2 / 10 ** (sample_quality / 10) if isinstance(sample_quality, Real) else -1.0,
        math.inf if most_bytes is None else max(0, most_bytes - header.length),
        most_significant,
    )
    return CodedImage(header.pack(), *_coded(PartialImage(header, encoder), encoder, samples, goal), peak)


class _Goal(NamedTuple):
    """When to end: at a mean squared error, a length of the stream, or a number of coefficients."""

    error: float
    room: float
    significant: int | None


def _coded(
    known: PartialImage, encoder: CoefficientEncoder, samples: NDArray[np.int32], goal: _Goal
) -> tuple[bytes, tuple[int, ...], tuple[float, ...]]:
    # The encoder pauses now and then: its output so far is exactly what a decoder would know.
    lengths, errors, ended = [0], [_error(known, samples)], encoder.complete
    while not ended and errors[-1] > goal.error and lengths[-1] < goal.room:
        # Twice the bytes never leave less than a 16th of the error, when nearly everything is known.
        growth = (errors[-1] / goal.error) ** 0.25 if goal.error > 0 else _GROWTH
        longer = math.ceil(lengths[-1] * min(_GROWTH, max(_LEAST_GROWTH, growth)))
        ended = encoder.code(int(min(goal.room, max(_FIRST_REST, longer))), goal.significant)
        lengths.append(encoder.length)
        errors.append(_error(known, samples))
    payload = encoder.stream(ended=ended)
    payload = payload if goal.room == math.inf else payload[: int(goal.room)]
    lengths[-1] = len(payload)
    return payload, tuple(lengths), tuple(errors)


def _error(known: PartialImage, samples: NDArray[np.int32]) -> float:
    off = known.integers() - samples
    return float(np.mean(np.square(off, dtype=np.float64)))


def _planes(
    samples: NDArray[np.int32], wavelet: Wavelet, middle: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.int16] | None]:
    """Return the planes to transform, the value subtracted from each, and the colour matrix, if any."""
    channels = samples.shape[2]
    if wavelet == "haar":
        # Equations 1 to 4 of the paper transform the sample unchanged; its mean only fills the first view.
        return samples, np.rint(samples.mean(axis=(0, 1))), None
    if wavelet == "9/7":
        means = np.rint(samples.mean(axis=(0, 1)))
        planes: NDArray[Any] = samples - means
        if channels < 3:
            return planes, means, None
        matrix = fit_klt(planes[..., :3])
        colors = planes[..., :3].reshape(-1, 3).T
        planes[..., :3] = np.linalg.solve(matrix / 16384.0, colors).T.reshape(*samples.shape[:2], 3)
        return planes, means, matrix
    if channels >= 3:
        planes = np.concatenate([to_ycocg(samples[..., :3]), samples[..., 3:]], axis=2)
        return planes, np.zeros(channels), None
    # Centred, so that the approximation's signs carry information.
    means = np.full(channels, middle)
    return samples - means.astype(np.int32), means, None


def _quantized(
    coefficients: NDArray[Any], header: ImageHeader, tree: Tree
) -> tuple[NDArray[np.int32], tuple[int, ...]]:
    """Return coefficients as the tree's integers, and "haar"'s thresholds."""
    values = np.zeros(tree.size, np.int32)
    thresholds: tuple[int, ...] = ()
    if header.wavelet == "haar":
        coefficients = np.trunc(coefficients * 2**header.fineness)
        thresholds = share_thresholds(np.abs(coefficients))
        coded = to_coded(coefficients, thresholds)
        if np.abs(coded).max() >> (MAX_PLANE + 1):
            thresholds = ()  # 16 bits and more than three levels: planes are powers of two alone
            coded = to_coded(coefficients, thresholds)
        coefficients = coded
    for band in tree.bands:
        part = coefficients[window(band, header.height, header.width)]
        if header.wavelet != "haar":
            part = np.trunc(part / unweight(header, band))
        values[tree.places(band)] = part.astype(np.int32)
    return values, thresholds


def check_image(
    image: PixelArray,
    *,
    wavelet: str | None = None,
    levels: int | None = None,
    sample_quality: Quality | None = None,
) -> Wavelet:
    """Raise InputError unless `encode_parts` accepts an image with these options; return the wavelet."""
    if image.ndim != 3 or 0 in image.shape or image.shape[2] > 64:
        raise InputError(f"image has shape {image.shape}; allowed: (height, width, 1 to 64 channels)")
    if image.size > MAX_SAMPLES or max(image.shape[:2]) > 65535:
        raise InputError(
            f"image has {image.size:,} samples ({image.shape[1]}×{image.shape[0]}); allowed: {MAX_SAMPLES:,}"
            f", 65535 each way; resized to {math.isqrt(MAX_SAMPLES // image.shape[2])} or less it fits"
        )
    if image.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"image is of {image.dtype}; allowed: uint8, uint16, float32")
    check_quality(sample_quality)
    chosen = ("5/3" if sample_quality == "lossless" else "9/7") if wavelet is None else wavelet
    if not isinstance(chosen, str) or chosen not in WAVELETS:
        raise InputError(f"unknown wavelet {chosen!r}; allowed: {', '.join(WAVELETS)}")
    if sample_quality == "lossless" and chosen == "9/7":
        raise InputError("wavelet is 9/7 with sample_quality lossless; allowed: 5/3, haar")
    if levels is not None:
        check_whole("levels", levels, 0, MAX_LEVELS)
    return cast(Wavelet, chosen)


def _levels(wavelet: Wavelet, height: int, width: int) -> int:
    if wavelet == "haar":
        return 3  # as in the paper
    return max(0, min(6, math.ceil(math.log2(max(1, min(height, width)))) - 2))


def _integers(image: PixelArray) -> tuple[NDArray[np.int32], float, float]:
    if image.dtype != np.float32:
        return image.astype(np.int32), 0.0, 1.0
    low, high = float(image.min()), float(image.max())
    if not -MAX_SAMPLE <= low <= high <= MAX_SAMPLE:  # false for NaN as well
        raise InputError(
            f"image has samples from {low:g} to {high:g}; allowed: finite, within ±{MAX_SAMPLE:.0f}"
        )
    scale = 65535 / (high - low) if high > low else 0.0
    return np.rint((image.astype(np.float64) - low) * scale).astype(np.int32), low, high


def _fineness(wavelet: Wavelet, coefficients: NDArray[Any]) -> int:
    # Coefficients are coded as multiples of 2^-fineness. A half is fine enough for every allowed quality. For
    # "haar", twice a coefficient of level 1 is an integer, and the loss in others changes no sample.
    if wavelet == "5/3":
        return 0
    largest = float(np.abs(coefficients).max()) * 1.1
    return 1 if wavelet == "haar" or largest <= 2 ** (MAX_PLANE - 1) else 0
