"""Whole images through the codec: samples to header and stream, and back from any prefix of it."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from upholster.codec.coder import MAX_PLANE, CoefficientDecoder, encode_coefficients
from upholster.codec.color import fit_klt, from_ycocg, to_ycocg, unmix
from upholster.codec.header import MAX_PLACES, MAX_SAMPLES, ImageHeader
from upholster.codec.thresholds import from_coded, share_thresholds, to_coded
from upholster.codec.tree import LL, Band, Tree, build_tree, tree_size
from upholster.errors import InputError, check_whole
from upholster.types import MAX_SAMPLE, PixelArray
from upholster.wavelet.lifting import MAX_LEVELS, WAVELETS, Wavelet, band_norms, forward, inverse

__all__ = ["ImageDecoder", "check_image", "encode_parts"]


def encode_parts(
    image: PixelArray,
    *,
    wavelet: Wavelet | None = None,
    levels: int | None = None,
    lossless: bool = False,
    most_bytes: int | None = None,
    most_significant: int | None = None,
) -> tuple[bytes, bytes]:
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
        0 to 10; by default three for "haar", or else as many as leave the approximation about 4 samples wide,
        at most 6.
    lossless
        Whether the whole stream must give every sample back exactly: asks for "5/3" or "haar".
    most_bytes
        Largest length of header and stream together; None: until every sample is within 1 of the original, or
        exact.
    most_significant
        Stop when so many coefficients have become significant.

    Returns
    -------
    header, payload : bytes
        The header (`ImageHeader`) and the stream; any prefix of the stream decodes.

    Raises
    ------
    InputError
        For an image or options that do not fit.
    """
    wavelet = check_image(image, wavelet=wavelet, levels=levels, lossless=lossless)
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
    for fineness in _finenesses(wavelet, coefficients):
        header = ImageHeader(
            height, width, channels, image.dtype, wavelet, levels, -1, fineness, matrix,
            wavelet == "5/3" and channels >= 3, tuple(int(mean) for mean in means), low, high,
        )  # fmt: skip
        tree = _tree(header)
        values, thresholds = _quantized(coefficients, header, tree)
        if np.abs(values).max() >> (MAX_PLANE + 1):
            # Only 16-bit samples can do this, and only with more levels than the default.
            raise InputError(f"levels is {levels}: coefficients of 16-bit samples overflow; allowed: 0 to 6")
        room = None if most_bytes is None else max(0, most_bytes - len(header.pack()))
        plane, payload = encode_coefficients(values, tree, most_bytes=room, most_significant=most_significant)
        header = replace(header, plane=plane, thresholds=thresholds)
        if wavelet != "9/7" or room is not None or most_significant is not None:
            break
        if _within_one(header, payload, samples):
            payload = payload[: _enough(header, payload, samples)]
            break
    return header.pack(), payload


def _planes(
    samples: NDArray[np.int32], wavelet: Wavelet, middle: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.int16] | None]:
    """Return the planes to transform, what was taken off each, and the colour matrix if there is one."""
    channels = samples.shape[2]
    if wavelet == "haar":
        # Equations 1 to 4 of the paper transform the sample as it is; its mean only fills the first view.
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
            thresholds = ()  # of 16 bits and more than three levels: planes are powers of two alone
            coded = to_coded(coefficients, thresholds)
        coefficients = coded
    for band in tree.bands:
        part = coefficients[_window(band, header.height, header.width)]
        if header.wavelet != "haar":
            part = np.trunc(part / _unweight(header, band))
        values[tree.places(band)] = part.astype(np.int32)
    return values, thresholds


def _within_one(header: ImageHeader, payload: bytes, samples: NDArray[np.int32]) -> bool:
    decoder = ImageDecoder(header)
    decoder.feed(payload)
    return bool(np.abs(decoder.integers() - samples).max() <= 1)


def _enough(header: ImageHeader, payload: bytes, samples: NDArray[np.int32]) -> int:
    # A length, to 2 %, from which on every sample is within 1: the last plane need not be coded to its end.
    low, high = len(payload) // 2, len(payload)
    while high - low > len(payload) // 50 + 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _within_one(header, payload[:middle], samples) else (middle, high)
    return high


def check_image(
    image: PixelArray, *, wavelet: str | None = None, levels: int | None = None, lossless: bool = False
) -> Wavelet:
    """Raise InputError unless `encode_parts` takes an image with these options; return the wavelet."""
    if image.ndim != 3 or 0 in image.shape or image.shape[2] > 64:
        raise InputError(f"image has shape {image.shape}; allowed: (height, width, 1 to 64 channels)")
    if image.size > MAX_SAMPLES or max(image.shape[:2]) > 65535:
        raise InputError(
            f"image has {image.size:,} samples ({image.shape[1]}×{image.shape[0]}); allowed: {MAX_SAMPLES:,}"
            f", 65535 each way; resized to {math.isqrt(MAX_SAMPLES // image.shape[2])} or less it fits"
        )
    if image.dtype not in (np.uint8, np.uint16, np.float32):
        raise InputError(f"image is of {image.dtype}; allowed: uint8, uint16, float32")
    chosen = ("5/3" if lossless else "9/7") if wavelet is None else wavelet
    if not isinstance(chosen, str) or chosen not in WAVELETS:
        raise InputError(f"unknown wavelet {chosen!r}; allowed: {', '.join(WAVELETS)}")
    if lossless and chosen == "9/7":
        raise InputError("wavelet is 9/7 with lossless; allowed: 5/3, haar")
    if levels is not None:
        check_whole("levels", levels, 0, MAX_LEVELS)
    return cast(Wavelet, chosen)


class ImageDecoder:
    """Decodes an image as its stream arrives.

    Parameters
    ----------
    header
        The image's header.
    """

    def __init__(self, header: ImageHeader) -> None:
        self.header = header
        self._tree = _tree(header)
        self._coefficients = CoefficientDecoder(self._tree, header.plane, exact=header.exact)

    @property
    def complete(self) -> bool:
        """Whether every plane is decoded."""
        return self._coefficients.complete

    @property
    def received(self) -> int:
        """Bytes of the stream taken so far."""
        return self._coefficients.received

    @property
    def unread(self) -> int:
        """Bytes behind the end of a complete stream, which mean nothing."""
        return self._coefficients.unread

    @property
    def significant(self) -> int:
        """How many coefficients are significant so far."""
        return self._coefficients.significant

    @property
    def coefficients(self) -> int:
        """How many coefficients there are, over all channels."""
        return self.header.height * self.header.width * self.header.channels

    def feed(self, data: bytes) -> None:
        """Take further bytes of the stream; the work is proportional to their number."""
        self._coefficients.feed(data)

    def image(self) -> PixelArray:
        """Return the image as far as it is known: (H, W, C) of the header's dtype."""
        integers = self.integers()
        header = self.header
        if header.dtype != np.float32:
            return integers.astype(header.dtype)
        step = (header.high - header.low) / 65535
        return (integers * step + header.low).astype(np.float32)

    def integers(self) -> NDArray[np.int32]:
        """Return the samples as the integers that are coded, (H, W, C)."""
        header = self.header
        shape = (header.height, header.width, header.channels)
        if header.wavelet == "haar":
            return self._haar_integers()
        real = header.wavelet == "9/7"
        nested = np.zeros(shape, np.float64 if real else np.int32)
        for band in self._tree.bands:
            part = self._coefficients.values(band) * _unweight(header, band)
            # Reversible transforms want integers: toward zero, which changes nothing once all planes are
            # there.
            nested[_window(band, header.height, header.width)] = part if real else np.trunc(part)
        planes = inverse(nested, wavelet=header.wavelet, levels=header.levels)
        del nested
        if header.matrix is not None:
            planes[..., :3] = unmix(planes[..., :3], header.matrix)
        if header.ycocg:
            planes[..., :3] = from_ycocg(planes[..., :3])
        planes += np.array(header.means, planes.dtype)
        return self._rounded(planes)

    def _haar_integers(self) -> NDArray[np.int32]:
        header = self.header
        nested = np.zeros((header.height, header.width, header.channels))
        means = self._means()
        for band in self._tree.bands:
            values = self._coefficients.values(band, means[band.channel] if band.kind == LL else 0)
            values = from_coded(values, header.thresholds)
            values /= 2**header.fineness
            nested[_window(band, header.height, header.width)] = values
        planes = inverse(nested, wavelet="haar", levels=header.levels)
        del nested
        return self._rounded(planes)

    def _means(self) -> list[int]:
        # What each channel's approximation is expected to be, as it would be coded.
        header = self.header
        means = np.array(header.means) << (header.levels + header.fineness)
        coded = to_coded(np.where(means >> (MAX_PLANE + 1), 0, means), header.thresholds)
        return [int(mean) for mean in coded]

    def _rounded(self, planes: NDArray[Any]) -> NDArray[np.int32]:
        # Half away from zero is the same everywhere; negative sums are clipped anyway.
        if planes.dtype == np.float64:
            planes += 0.5
            np.floor(planes, out=planes)
        most = 255 if self.header.dtype == np.uint8 else 65535
        return np.clip(planes, 0, most, out=planes).astype(np.int32, copy=False)


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


def _finenesses(wavelet: Wavelet, coefficients: NDArray[Any]) -> list[int]:
    # A half is fine enough for most images; finer ones follow until every sample is within 1.
    if wavelet == "5/3":
        return [0]
    if wavelet == "haar":
        # Twice a coefficient of level 1 is whole, and what the others lose changes no sample once rounded.
        return [1]
    largest = float(np.abs(coefficients).max()) * 1.1
    room = MAX_PLANE - math.ceil(math.log2(max(1.0, largest)))
    return [fineness for fineness in range(1, 8) if fineness <= room] or [max(0, room)]


def _tree(header: ImageHeader) -> Tree:
    lowest = None
    if header.wavelet == "5/3":
        lowest = tuple(
            tuple(_shift(header.wavelet, level, kind, header.levels) for kind in range(4))
            for level in range(header.levels + 1)
        )
    return build_tree(header.height, header.width, header.channels, header.levels, lowest)


@lru_cache
def _shift(wavelet: Wavelet, level: int, kind: int, levels: int) -> int:
    # Norms of the reversible transform are powers of 2, the smallest of them 1/2 (HH1).
    norm = band_norms(wavelet, level)[kind]
    return round(math.log2(norm)) + (1 if levels > 0 else 0)


def _unweight(header: ImageHeader, band: Band) -> float:
    """Return what a coded value is multiplied with to give a coefficient: a multiple of 1/2^20 for "9/7"."""
    if header.wavelet == "5/3":
        return 1.0 / 2 ** _shift(header.wavelet, band.level, band.kind, header.levels)
    norm = band_norms(header.wavelet, band.level)[band.kind]
    return round(2**20 / norm) / 2.0 ** (20 + header.fineness)


def _window(band: Band, height: int, width: int) -> tuple[slice, slice, int]:
    """Return where a band lies in the nested layout."""
    top = -(-height // 2**band.level) if band.kind >= 2 else 0
    left = -(-width // 2**band.level) if band.kind % 2 else 0
    return slice(top, top + band.rows), slice(left, left + band.columns), band.channel
