"""An image at the precision of its known coefficients, for decoders and for the encoder itself."""

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import PixelArray
from upholster.codec.coder import MAX_PLANE, CoefficientDecoder, Coefficients
from upholster.codec.color_transforms import from_ycocg, unmix
from upholster.codec.header import ImageHeader
from upholster.codec.lifting import Wavelet, band_norms, inverse
from upholster.codec.thresholds import from_coded, to_coded
from upholster.codec.tree import LL, Band, Tree, build_tree

__all__ = ["ImageDecoder", "PartialImage", "tree_of", "unweight", "window"]


class PartialImage:
    """An image at the precision of some known coefficients.

    Parameters
    ----------
    header
        The image's header.
    coefficients
        The coefficients, in the order of `tree_of` for this header.
    """

    def __init__(self, header: ImageHeader, coefficients: Coefficients) -> None:
        self.header = header
        self._coefficients = coefficients

    def image(self) -> PixelArray:
        """Return the image at its current precision: (H, W, C) of the header's dtype."""
        integers = self.integers()
        header = self.header
        if header.dtype != np.float32:
            return integers.astype(header.dtype)
        step = (header.high - header.low) / 65535
        return (integers * step + header.low).astype(np.float32)

    def integers(self) -> NDArray[np.int32]:
        """Return the samples as the coded integers, (H, W, C)."""
        header = self.header
        shape = (header.height, header.width, header.channels)
        if header.wavelet == "haar":
            return self._haar_integers()
        real = header.wavelet == "9/7"
        nested = np.zeros(shape, np.float64 if real else np.int32)
        for band in self._coefficients.tree.bands:
            part = self._coefficients.values(band) * unweight(header, band)
            # Reversible transforms need integers: round toward zero, which changes nothing once all planes
            # are known.
            nested[window(band, header.height, header.width)] = part if real else np.trunc(part)
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
        for band in self._coefficients.tree.bands:
            values = self._coefficients.values(band, means[band.channel] if band.kind == LL else 0)
            values = from_coded(values, header.thresholds)
            values /= 2**header.fineness
            nested[window(band, header.height, header.width)] = values
        planes = inverse(nested, wavelet="haar", levels=header.levels)
        del nested
        return self._rounded(planes)

    def _means(self) -> list[int]:
        # The expected value of each channel's approximation, as it would be coded.
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


class ImageDecoder(PartialImage):
    """Decodes an image as its stream arrives.

    Parameters
    ----------
    header
        The image's header.
    """

    _coefficients: CoefficientDecoder

    def __init__(self, header: ImageHeader) -> None:
        super().__init__(header, CoefficientDecoder(tree_of(header), header.plane, exact=header.exact))

    @property
    def complete(self) -> bool:
        """Whether every plane is decoded."""
        return self._coefficients.complete

    @property
    def received(self) -> int:
        """Bytes of the stream read so far."""
        return self._coefficients.received

    @property
    def unread(self) -> int:
        """Bytes after the end of a complete stream, which are ignored."""
        return self._coefficients.unread

    @property
    def significant(self) -> int:
        """Number of coefficients that are significant so far."""
        return self._coefficients.significant

    @property
    def coefficients(self) -> int:
        """Number of coefficients over all channels."""
        return self.header.height * self.header.width * self.header.channels

    def feed(self, data: bytes) -> None:
        """Take further bytes of the stream; the work is proportional to their number."""
        self._coefficients.feed(data)


def tree_of(header: ImageHeader) -> Tree:
    """Return the layout of an image's coefficients in the coder's memory."""
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


def unweight(header: ImageHeader, band: Band) -> float:
    """Return the factor from a coded value to its coefficient: a multiple of 1/2^20 for "9/7"."""
    if header.wavelet == "5/3":
        return 1.0 / 2 ** _shift(header.wavelet, band.level, band.kind, header.levels)
    norm = band_norms(header.wavelet, band.level)[band.kind]
    return round(2**20 / norm) / 2.0 ** (20 + header.fineness)


def window(band: Band, height: int, width: int) -> tuple[slice, slice, int]:
    """Return the position of a band in the nested layout."""
    top = -(-height // 2**band.level) if band.kind >= 2 else 0
    left = -(-width // 2**band.level) if band.kind % 2 else 0
    return slice(top, top + band.rows), slice(left, left + band.columns), band.channel
