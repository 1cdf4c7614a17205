"""Pictures without noise, as people draw them: few values, many exact zeros, equal to their own mirror."""

from collections.abc import Callable

import numpy as np

from upholster.base.types import FloatArray, PixelArray

__all__ = ["DEPTHS", "PICTURES", "picture"]

DEPTHS = (np.uint8, np.uint16, np.float32)


def _knurl(y: FloatArray, x: FloatArray) -> FloatArray:
    return 1 - np.minimum(abs((x + y) % 32 - 16), abs((x - y) % 32 - 16)) / 16


def _mirrored(y: FloatArray, x: FloatArray) -> FloatArray:
    noise = np.random.default_rng(1).random(x.shape)
    return (noise + noise[:, ::-1]) / 2


PICTURES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "black": lambda _, x: 0 * x,
    "white": lambda _, x: 0 * x + 1,
    "two colours": lambda _, x: x // (len(x) // 2) % 2,
    "checkerboard": lambda y, x: (x // 8 + y // 8) % 2,
    "checkerboard of pixels": lambda y, x: (x + y) % 2,
    "stripes": lambda y, _: y // 8 % 2,
    "line": lambda _, x: 1.0 * (x == len(x) // 2),
    "slanted line": lambda y, x: 1.0 * (x == y),
    "dot": lambda y, x: 1.0 * ((x == len(x) // 2) & (y == len(x) // 2)),
    "corner": lambda y, x: 1.0 * (x + y == 0),
    "gradient": lambda _, x: x / (len(x) - 1),
    "slanted gradient": lambda y, x: (x + y) / (2 * len(x) - 2),
    "mirrored": _mirrored,
    "mirrored gradient": lambda _, x: abs(2 * x / (len(x) - 1) - 1),
    "knurl": _knurl,
    "wave": lambda _, x: (1 + np.sin(x * np.pi / 8)) / 2,
    "grid of dots": lambda y, x: 1.0 * ((x % 16 == 8) & (y % 16 == 8)),
}
"""From rows and columns, (H, W) both, to values from 0 to 1."""


def picture(name: str, dtype: type, *, side: int = 128, channels: int = 1) -> PixelArray:
    """Return a picture of that name and depth, (side, side, channels)."""
    y, x = np.mgrid[:side, :side].astype(np.float64)
    values = PICTURES[name](y, x)[:, :, None].repeat(channels, axis=2)
    return (values if dtype is np.float32 else np.rint(values * np.iinfo(dtype).max)).astype(dtype)
