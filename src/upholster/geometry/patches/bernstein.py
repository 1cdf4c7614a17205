"""Bernstein polynomials, and two operations on control nets: splitting and degree elevation."""

import numpy as np

from upholster.base.types import FloatArray

__all__ = ["bernstein", "bernstein_derivative", "elevate_axis", "split_axis"]


def bernstein(degree: int, t: FloatArray) -> FloatArray:
    """Return the Bernstein polynomials of one degree: ``B[..., j] = C(degree, j)·t^j·(1 - t)^(degree - j)``.

    Built up degree by degree, which on [0, 1] only adds non-negative numbers: as accurate at degree 32 as at
    2.

    Parameters
    ----------
    degree
        0 or more.
    t
        Parameters, shape (...,).

    Returns
    -------
    FloatArray
        Shape (..., degree + 1); sums to 1 along the last axis.

    References
    ----------
    G. Farin, *Curves and Surfaces for CAGD*, 5th edition, equation (5.2).
    """
    values = np.zeros((*np.shape(t), degree + 1))
    values[..., 0] = 1.0
    rest = 1.0 - t
    for d in range(1, degree + 1):
        values[..., d] = t * values[..., d - 1]
        for j in range(d - 1, 0, -1):
            values[..., j] = rest * values[..., j] + t * values[..., j - 1]
        values[..., 0] *= rest
    return values


def bernstein_derivative(degree: int, t: FloatArray) -> FloatArray:
    """Return the first derivatives of `bernstein` by t, shape (..., degree + 1); they sum to 0."""
    values = np.zeros((*np.shape(t), degree + 1))
    if degree > 0:
        lower = degree * bernstein(degree - 1, t)
        values[..., 1:] += lower
        values[..., :-1] -= lower
    return values


def split_axis(net: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
    """Split along the first axis at parameter `at` by de Casteljau's algorithm; return both parts' nets."""
    level = np.array(net)
    before, after = np.empty_like(level), np.empty_like(level)
    degree = len(level) - 1
    for k in range(degree + 1):
        before[k], after[degree - k] = level[0], level[-1]
        level = (1.0 - at) * level[:-1] + at * level[1:]
    return before, after


def elevate_axis(net: FloatArray, degree: int) -> FloatArray:
    """Raise the degree along the first axis to `degree`: a different net for the same polynomial."""
    for d in range(len(net), degree + 1):
        share = (np.arange(d + 1) / d).reshape(-1, *[1] * (net.ndim - 1))
        raised = np.zeros((d + 1, *net.shape[1:]))
        raised[1:] += share[1:] * net
        raised[:-1] += (1.0 - share[:-1]) * net
        net = raised
    return net
