"""How different two pictures look when one flips from one to the other: LDR-FLIP, written from its paper.

P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild: *FLIP: a difference
evaluator for alternating images*, Proc. ACM Comput. Graph. Interact. Tech. 3 (2), 2020. Section numbers below
are the paper's.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from upholster.image import to_linear
from upholster.types import FloatArray

__all__ = ["PIXELS_PER_DEGREE", "flip_map"]

PIXELS_PER_DEGREE = 67.0
"""A 0.7 m wide screen of 3840 pixels seen from 0.7 m, as in the paper."""

_TO_XYZ = np.array(
    [
        [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
        [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
        [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
    ]
)
_WHITE = _TO_XYZ.sum(axis=1)
# Contrast sensitivity as sums of Gaussians (a, b): achromatic, red-green, blue-yellow (section 4.1.1).
_SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
_Q_COLOR, _P_COLOR, _P_TARGET = 0.7, 0.4, 0.95
_FEATURE_WIDTH, _Q_FEATURE = 0.082, 0.5


def flip_map(
    reference: NDArray[np.uint8], other: NDArray[np.uint8], *, pixels_per_degree: float = PIXELS_PER_DEGREE
) -> FloatArray:
    """Return the difference seen at each pixel of two sRGB pictures.

    Parameters
    ----------
    reference, other
        (H, W, 3) uint8.
    pixels_per_degree
        How large a pixel is seen.

    Returns
    -------
    ndarray
        (H, W), 0 (the same) to 1 (black and white).
    """
    opponents = [_opponent(to_linear(image).astype(np.float64)) for image in (reference, other)]
    color = _color_difference(*(_perceived(image, pixels_per_degree) for image in opponents))
    before, after = ((image[..., 0] + 16) / 116 for image in opponents)
    return np.asarray(color ** (1 - _feature_difference(before, after, pixels_per_degree)))


def _opponent(linear: FloatArray) -> FloatArray:
    # Linear RGB to YCxCz.
    x, y, z = np.moveaxis(linear @ _TO_XYZ.T / _WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _linear(opponent: FloatArray) -> FloatArray:
    y, cx, cz = np.moveaxis(opponent, -1, 0)
    y = (y + 16) / 116
    xyz = np.stack([y + cx / 500, y, y - cz / 200], axis=-1) * _WHITE
    return np.asarray(xyz @ np.linalg.inv(_TO_XYZ).T)


def _perceived(opponent: FloatArray, ppd: float) -> FloatArray:
    # What passes the eye's contrast sensitivity, in L*a*b* with Hunt's adjustment (sections 4.1.1, 4.1.2).
    widest = max(b for terms in _SENSITIVITY for _, b in terms)
    radius = int(np.ceil(3 * np.sqrt(widest / (2 * np.pi**2)) * ppd))
    places = np.arange(-radius, radius + 1) / ppd
    filtered = np.empty_like(opponent)
    for channel, terms in enumerate(_SENSITIVITY):
        total, weights = np.zeros(opponent.shape[:2]), 0.0
        for a, b in terms:
            line = np.exp(-(np.pi**2) * places**2 / b)
            share = a * np.pi / b
            total += share * _blurred(opponent[..., channel], line, line)
            weights += share * line.sum() ** 2
        filtered[..., channel] = total / weights
    return _hunt(_lab(np.clip(_linear(filtered), 0, 1)))


def _blurred(plane: FloatArray, down: FloatArray, across: FloatArray) -> FloatArray:
    return np.asarray(
        correlate1d(correlate1d(plane, down, axis=0, mode="nearest"), across, axis=1, mode="nearest")
    )


def _lab(linear: FloatArray) -> FloatArray:
    ratios = linear @ _TO_XYZ.T / _WHITE
    low = 6 / 29
    bent = np.where(ratios > low**3, np.cbrt(ratios), ratios / (3 * low**2) + 4 / 29)
    x, y, z = np.moveaxis(bent, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _hunt(lab: FloatArray) -> FloatArray:
    return np.asarray(lab * np.stack([np.ones(lab.shape[:-1])] + [0.01 * lab[..., 0]] * 2, axis=-1))


def _hyab(a: FloatArray, b: FloatArray) -> FloatArray:
    difference = a - b
    return np.asarray(np.abs(difference[..., 0]) + np.hypot(difference[..., 1], difference[..., 2]))


def _color_difference(a: FloatArray, b: FloatArray) -> FloatArray:
    # Large differences are compressed, so that small ones count (section 4.1.3).
    green, blue = (_hunt(_lab(np.array(color, np.float64))) for color in ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
    most = _hyab(green, blue) ** _Q_COLOR
    found, bend = _hyab(a, b) ** _Q_COLOR, _P_COLOR * most
    low = found * _P_TARGET / bend
    high = _P_TARGET + (found - bend) / (most - bend) * (1 - _P_TARGET)
    return np.asarray(np.clip(np.where(found < bend, low, high), 0, 1))


def _feature_difference(a: FloatArray, b: FloatArray, ppd: float) -> FloatArray:
    # Edges by first derivatives of a Gaussian, points by second ones (section 4.2).
    sigma = 0.5 * _FEATURE_WIDTH * ppd
    places = np.arange(-int(np.ceil(3 * sigma)), int(np.ceil(3 * sigma)) + 1)
    bell = np.exp(-(places**2) / (2 * sigma**2))
    found = []
    for kernel in (-places * bell, (places**2 / sigma**2 - 1) * bell):
        # Positive and negative weights of the two-dimensional kernel each sum to 1.
        positive = kernel[kernel > 0].sum() * bell.sum()
        negative = -kernel[kernel < 0].sum() * bell.sum()
        scaled = np.where(kernel > 0, kernel / positive, kernel / negative)
        strengths = [
            np.hypot(_blurred(light, bell, scaled), _blurred(light, scaled, bell)) for light in (a, b)
        ]
        found.append(np.abs(strengths[0] - strengths[1]))
    return np.asarray((np.maximum(*found) / np.sqrt(2)) ** _Q_FEATURE)
