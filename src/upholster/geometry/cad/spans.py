"""Splines and arcs cut into rational Bézier segments: the same curves, exactly."""

from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.geometry.occt.records import CurveRecord

__all__ = ["Axis", "Segments", "arc_axis", "curve_segments", "spline_segments"]

_EPS = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class Axis:
    """A parameter of the file along consecutive segments.

    Attributes
    ----------
    breaks
        (n + 1,) rising: segment k covers from ``breaks[k]`` to ``breaks[k + 1]``.
    is_angle
        Whether it is the angle of an arc. On a rational quadratic segment, the tangent of half the angle from
        its middle is linear, not the angle itself.
    period
        Its period; 0 for none.
    """

    breaks: FloatArray
    is_angle: bool = False
    period: float = 0.0

    def places(self, values: FloatArray) -> FloatArray:
        """Return each value's k + parameter on segment k; beyond the ends, the outer segments continue."""
        values, k = self._found(values)
        low, high = self.breaks[k], self.breaks[k + 1]
        if not self.is_angle:
            return np.asarray(k + (values - low) / (high - low), np.float64)
        turned = np.tan(0.5 * (values - 0.5 * (low + high))) / np.tan(0.25 * (high - low))
        return np.asarray(k + 0.5 + 0.5 * turned, np.float64)

    def rates(self, values: FloatArray) -> FloatArray:
        """Return the derivatives of `places`."""
        values, k = self._found(values)
        low, high = self.breaks[k], self.breaks[k + 1]
        if not self.is_angle:
            return np.asarray(1.0 / (high - low), np.float64)
        cosine = np.cos(0.5 * (values - 0.5 * (low + high)))
        return np.asarray(0.25 / (cosine * cosine * np.tan(0.25 * (high - low))), np.float64)

    def _found(self, values: FloatArray) -> tuple[FloatArray, IntArray]:
        """Shift values by whole periods to near the middle of the range; return them and their segments."""
        if self.period:
            middle = 0.5 * float(self.breaks[0] + self.breaks[-1])
            values = values - self.period * np.round((values - middle) / self.period)
        k = np.searchsorted(self.breaks, values, side="right") - 1
        return values, np.clip(k, 0, len(self.breaks) - 2)


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """A curve as segments: homogeneous control points (n, degree + 1, 4), and the parameter along them."""

    points: FloatArray
    axis: Axis


def spline_segments(
    degree: int, knots: FloatArray, poles: FloatArray, low: float, high: float, period: float = 0.0
) -> tuple[FloatArray, Axis]:
    """Cut a spline into its Bézier segments.

    A segment's control point k is the spline's blossom with the segment's start as degree − k arguments and
    its end as k arguments. Inserting the knots to full multiplicity gives the same.

    Parameters
    ----------
    degree
        1 or more.
    knots
        ``n + degree + 1`` increasing knots, repeated by multiplicity.
    poles
        (n, …) control points, homogeneous.
    low, high
        The range needed.
    period
        The parameter's period; then the complete spline is cut.

    Returns
    -------
    FloatArray
        (segments, degree + 1, …).
    Axis
        The parameter along them.

    Raises
    ------
    InputError
        If the numbers do not match.

    References
    ----------
    L. Ramshaw: Blossoms are polar forms, CAGD 6, 1989; W. Boehm: Inserting new knots into B-spline curves,
    CAD 12, 1980.
    """
    if degree < 1 or len(knots) != len(poles) + degree + 1 or len(poles) <= degree:
        raise InputError(
            f"a spline of degree {degree} has {len(knots)} knots for {len(poles)} control points"
        )
    spans = np.arange(degree, len(poles))
    spans = spans[knots[spans + 1] > knots[spans]]
    if not len(spans):
        raise InputError("a spline's knots do not rise; allowed: rising ones")
    eps = _EPS * float(knots[-1] - knots[0])
    if not period:
        wanted = (knots[spans + 1] > low + eps) & (knots[spans] < high - eps)
        spans = spans[wanted] if wanted.any() else spans
        spans = np.arange(spans[0], spans[-1] + 1)
        spans = spans[knots[spans + 1] > knots[spans]]
    local = poles[spans[:, None] + np.arange(-degree, 1)]  # (segments, degree + 1, ...)
    out = np.empty_like(local)
    shape = (-1,) + (1,) * (poles.ndim - 1)
    for k in range(degree + 1):
        level = local.copy()
        for r in range(1, degree + 1):
            at = knots[spans] if r <= degree - k else knots[spans + 1]
            for j in range(degree, r - 1, -1):
                left, right = knots[spans + j - degree], knots[spans + j + 1 - r]
                share = ((at - left) / (right - left)).reshape(shape)
                level[:, j] = (1.0 - share) * level[:, j - 1] + share * level[:, j]
        out[:, k] = level[:, degree]
    return out, Axis(np.append(knots[spans], knots[spans[-1] + 1]), False, period)


def arc_axis(low: float, high: float, period: float) -> Axis:
    """Return an angle's axis over the fewest arcs of at most a quarter circle that cover low … high."""
    count = max(1, int(np.ceil((high - low) / (0.5 * np.pi) - 1e-6)))
    return Axis(np.linspace(low, high, count + 1), True, period)


def curve_segments(curve: CurveRecord, low: float, high: float, period: float = 0.0) -> Segments:
    """Cut a curve into rational Bézier segments from low to high, in its own parameter.

    Raises
    ------
    InputError
        If the range is empty, or the numbers do not match.
    """
    if not high > low:
        raise InputError(f"a curve runs from {low:g} to {high:g}; allowed: rising")
    if curve.kind == "spline":
        return Segments(*spline_segments(curve.degree, curve.knots, curve.poles, low, high, period))
    if curve.kind == "line":
        ends = curve.poles[0] + np.array([low, high])[:, None] * curve.poles[1]
        return Segments(ends[None], Axis(np.array([low, high])))
    axis = arc_axis(low, high, period)
    centre, first, second = curve.poles
    a, b = axis.breaks[:-1], axis.breaks[1:]
    weight = np.cos(0.5 * (b - a))[:, None]
    ends = [np.cos(v)[:, None] * first + np.sin(v)[:, None] * second for v in (a, 0.5 * (a + b), b)]
    points = np.stack([ends[0] + centre, ends[1] + weight * centre, ends[2] + centre], axis=1)
    return Segments(points, axis)
