"""One level of the orthonormal 2-D Haar transform, forward and inverse."""

from upholster.base.types import FloatArray
from upholster.runtime.jit import inline, kernel

__all__ = ["haar_forward", "haar_inverse"]

_ROOT_HALF = 0.7071067811865476


@inline
def _split(image: FloatArray, low: FloatArray, out: FloatArray, i: int, j: int, k: int) -> None:
    rows, columns = low.shape[0], low.shape[1]
    a, b = image[2 * i, 2 * j, k], image[2 * i, 2 * j + 1, k]
    c, d = image[2 * i + 1, 2 * j, k], image[2 * i + 1, 2 * j + 1, k]
    low[i, j, k] = 0.5 * ((a + b) + (c + d))
    out[i, columns + j, k] = 0.5 * ((a - b) + (c - d))
    out[rows + i, j, k] = 0.5 * ((a + b) - (c + d))
    out[rows + i, columns + j, k] = 0.5 * ((a - b) - (c - d))


@inline
def _merge(low: FloatArray, coefficients: FloatArray, image: FloatArray, i: int, j: int, k: int) -> None:
    rows, columns = low.shape[0], low.shape[1]
    ll, hl = low[i, j, k], coefficients[i, columns + j, k]
    lh, hh = coefficients[rows + i, j, k], coefficients[rows + i, columns + j, k]
    image[2 * i, 2 * j, k] = 0.5 * ((ll + hl) + (lh + hh))
    image[2 * i, 2 * j + 1, k] = 0.5 * ((ll - hl) + (lh - hh))
    image[2 * i + 1, 2 * j, k] = 0.5 * ((ll + hl) - (lh + hh))
    image[2 * i + 1, 2 * j + 1, k] = 0.5 * ((ll - hl) - (lh - hh))


@kernel
def haar_forward(image: FloatArray, low: FloatArray, out: FloatArray) -> None:
    """Transform `image` (h, w, c): LL goes to `low`, HL, LH and HH to their quadrants of `out` (h, w, c).

    A last row or column without a partner passes unchanged into the low-pass half, which keeps the transform
    orthonormal at odd sizes.
    """
    height, width, channels = image.shape
    rows, columns = height // 2, width // 2
    low_rows, low_columns = height - rows, width - columns
    for i in range(rows):
        if channels == 1:  # a separate loop, which the compiler vectorizes
            for j in range(columns):
                _split(image, low, out, i, j, 0)
        else:
            for j in range(columns):
                for k in range(channels):
                    _split(image, low, out, i, j, k)
        if width % 2:
            for k in range(channels):
                a, c = image[2 * i, width - 1, k], image[2 * i + 1, width - 1, k]
                low[i, columns, k] = _ROOT_HALF * (a + c)
                out[low_rows + i, columns, k] = _ROOT_HALF * (a - c)
    if height % 2:
        for j in range(columns):
            for k in range(channels):
                a, b = image[height - 1, 2 * j, k], image[height - 1, 2 * j + 1, k]
                low[rows, j, k] = _ROOT_HALF * (a + b)
                out[rows, low_columns + j, k] = _ROOT_HALF * (a - b)
        if width % 2:
            for k in range(channels):
                low[rows, columns, k] = image[height - 1, width - 1, k]


@kernel
def haar_inverse(low: FloatArray, coefficients: FloatArray, image: FloatArray) -> None:
    """Invert `haar_forward`: LL from `low` and the other bands from `coefficients` give `image` (h, w, c)."""
    height, width, channels = image.shape
    rows, columns = height // 2, width // 2
    low_rows, low_columns = height - rows, width - columns
    for i in range(rows):
        if channels == 1:
            for j in range(columns):
                _merge(low, coefficients, image, i, j, 0)
        else:
            for j in range(columns):
                for k in range(channels):
                    _merge(low, coefficients, image, i, j, k)
        if width % 2:
            for k in range(channels):
                ll, lh = low[i, columns, k], coefficients[low_rows + i, columns, k]
                image[2 * i, width - 1, k] = _ROOT_HALF * (ll + lh)
                image[2 * i + 1, width - 1, k] = _ROOT_HALF * (ll - lh)
    if height % 2:
        for j in range(columns):
            for k in range(channels):
                ll, hl = low[rows, j, k], coefficients[rows, low_columns + j, k]
                image[height - 1, 2 * j, k] = _ROOT_HALF * (ll + hl)
                image[height - 1, 2 * j + 1, k] = _ROOT_HALF * (ll - hl)
        if width % 2:
            for k in range(channels):
                image[height - 1, width - 1, k] = low[rows, columns, k]
