"""`RationalPatch`: one rational Bézier patch of any degree, its points, derivatives and normals."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, frozen_array
from upholster.geometry.patches._kernels import evaluate, grid_points
from upholster.geometry.patches.bernstein import bernstein, elevate_axis, split_axis
from upholster.geometry.patches.normals import unit_normals
from upholster.runtime.parallel import run_tasks, thread_count

__all__ = ["MAX_DEGREE", "RationalPatch", "parameter_list", "parameter_pairs"]

MAX_DEGREE = 32

LARGEST = 1e30
"""Limit of coordinates, weights and 1/weight: products of five of them stay finite."""

MANY = 100_000
"""From this many points on, threads share the evaluation."""


@dataclass(frozen=True, slots=True, eq=False)
class RationalPatch:
    """A rational Bézier patch of degree (m, n).

    The point at (s, t) is the Bernstein sum ``Σ B_i(s)·B_j(t)·net[i, j]``, its first three components divided
    by the fourth. The patch covers (s, t) in [0, 1]²; beyond, the same rational functions continue. The
    normal is along S_s × S_t. Two patches are equal only if they are the same object.

    Attributes
    ----------
    net
        Homogeneous control net ``(w·x, w·y, w·z, w)``, shape (m+1, n+1, 4), float64, read-only; x, y, z in
        the model's units; degrees 1 to 32; weights positive, from 1e-30 to 1e30.

    Raises
    ------
    InputError
        If the shape, the degree or a number is out of range; names the index [i, j].

    References
    ----------
    G. Farin, *Curves and Surfaces for CAGD*, 5th edition, chapter 15 (rational Bézier patches).
    """

    net: FloatArray

    def __post_init__(self) -> None:
        """Check and freeze the net."""
        try:
            net = np.array(self.net, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise InputError(
                f"a control net must be an array of numbers of shape (m+1, n+1, 4): {error}"
            ) from None
        if net.ndim != 3 or net.shape[2] != 4:
            raise InputError(
                f"a control net has shape {net.shape}; allowed: (m+1, n+1, 4), homogeneous points"
            )
        if not (2 <= net.shape[0] <= MAX_DEGREE + 1 and 2 <= net.shape[1] <= MAX_DEGREE + 1):
            raise InputError(
                f"a control net has {net.shape[0]} x {net.shape[1]} points; "
                f"allowed: 2 to {MAX_DEGREE + 1} each way"
            )
        # Two comparisons first, for there may be very many patches; both fail for a NaN.
        if not (np.abs(net).max() <= LARGEST and net[..., 3].min() >= 1 / LARGEST):
            raise _outside(net)
        object.__setattr__(self, "net", frozen_array(net))

    def __repr__(self) -> str:
        return f"RationalPatch(degree={self.degree})"

    @classmethod
    def from_points(cls, points: ArrayLike, weights: ArrayLike | None = None) -> "RationalPatch":
        """Make a patch from points (m+1, n+1, 3), in the model's units, and weights (m+1, n+1), or all 1.

        Raises
        ------
        InputError
            As for the class; also if the two shapes do not match.
        """
        try:
            xyz = np.asarray(points, dtype=np.float64)
            w = None if weights is None else np.asarray(weights, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"control points and weights must be arrays of numbers: {error}") from None
        if xyz.ndim != 3 or xyz.shape[2] != 3:
            raise InputError(f"control points have shape {xyz.shape}; allowed: (m+1, n+1, 3)")
        net = np.ones((*xyz.shape[:2], 4))
        net[..., :3] = xyz
        if w is not None:
            if w.shape != xyz.shape[:2]:
                raise InputError(
                    f"weights have shape {w.shape}; allowed: {xyz.shape[:2]}, one per control point"
                )
            with np.errstate(invalid="ignore", over="ignore"):  # results of wrong numbers are refused below
                net *= w[..., None]
        return cls(net)

    @property
    def degree(self) -> tuple[int, int]:
        """Degrees (m, n) along s and along t."""
        return self.net.shape[0] - 1, self.net.shape[1] - 1

    @property
    def control_points(self) -> FloatArray:
        """Control points (m+1, n+1, 3) in the model's units, weights divided out."""
        return self.net[..., :3] / self.net[..., 3:]

    @property
    def weights(self) -> FloatArray:
        """Weights (m+1, n+1), read-only."""
        return self.net[..., 3]

    def points_grid(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return the points at all pairs of s (S,) and t (T,): shape (S, T, 3), in the model's units.

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        s, t = parameter_list("s", s), parameter_list("t", t)
        out = np.empty((len(s), len(t), 3))
        # Writeable like all the kernels' arrays, so that one compiled version serves all callers.
        net = np.array(self.net)
        bs = bernstein(self.degree[0], s)
        bt = np.ascontiguousarray(bernstein(self.degree[1], t).T)
        _in_parts(len(s), len(s) * len(t), lambda a, b: grid_points(net, bs[a:b], bt, out[a:b]))
        return out

    def derivatives_grid(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points and derivatives (P, S_s, S_t) at all pairs of s (S,) and t (T,): each (S, T, 3).

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        values = self._grid(parameter_list("s", s), parameter_list("t", t))
        return values[:, :, 0], values[:, :, 1], values[:, :, 2]

    def normals_grid(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return unit normals at all pairs of parameters s (S,) and t (T,): shape (S, T, 3).

        At degenerate points (poles, collapsed edges) they are the limits along the patch; never NaN.

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        return self.frames_grid(s, t)[1]

    def frames_grid(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return points and unit normals at all pairs of s (S,) and t (T,), in one go: each (S, T, 3).

        Raises
        ------
        InputError
            If s or t is not a list of finite numbers.
        """
        s, t = parameter_list("s", s), parameter_list("t", t)
        values = self._grid(s, t)
        flat = values.reshape(-1, 3, 3)
        normals = unit_normals(flat, np.repeat(s, len(t)), np.tile(t, len(s)), self.net, self._scattered)
        return values[:, :, 0], normals.reshape(len(s), len(t), 3)

    def points(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return the points at parameters s and t of one shape (...,): shape (..., 3), in the model's units.

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        return self.derivatives(s, t)[0]

    def derivatives(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points and first derivatives (P, S_s, S_t) at s and t of one shape (...,): each (..., 3).

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        s, t = parameter_pairs(s, t)
        values = self._scattered(s.ravel(), t.ravel()).reshape(*s.shape, 3, 3)
        return values[..., 0, :], values[..., 1, :], values[..., 2, :]

    def normals(self, s: ArrayLike, t: ArrayLike) -> FloatArray:
        """Return unit normals at parameters s and t of one shape (...,): shape (..., 3).

        At degenerate points (poles, collapsed edges) they are the limits along the patch; never NaN.

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        return self.frames(s, t)[1]

    def frames(self, s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return points and unit normals at s and t of one shape (...,), each (..., 3), in one evaluation.

        Raises
        ------
        InputError
            If s and t are not finite numbers of one shape.
        """
        s, t = parameter_pairs(s, t)
        shape, s, t = s.shape, s.ravel(), t.ravel()
        values = self._scattered(s, t)
        normals = unit_normals(values, s, t, self.net, self._scattered)
        return values[:, 0].reshape(*shape, 3), normals.reshape(*shape, 3)

    def split(
        self, *, s: float | None = None, t: float | None = None
    ) -> tuple["RationalPatch", "RationalPatch"]:
        """Split at ``s=…`` or at ``t=…`` (one of them, inside (0, 1)) into the parts before and after it.

        Raises
        ------
        InputError
            If not exactly one parameter is given, or it is not inside (0, 1).
        """
        if (s is None) == (t is None):
            raise InputError("split needs exactly one of s and t, a number inside (0, 1)")
        name, at = ("s", s) if s is not None else ("t", t)
        if not (isinstance(at, int | float) and 0.0 < at < 1.0):
            raise InputError(f"split at {name}={at}; allowed: a number inside (0, 1)")
        before, after = split_axis(self.net if name == "s" else self.net.swapaxes(0, 1), float(at))
        if name == "t":
            before, after = before.swapaxes(0, 1), after.swapaxes(0, 1)
        return RationalPatch(before), RationalPatch(after)

    def part(self, s0: float, s1: float, t0: float, t1: float) -> "RationalPatch":
        """Return the part of the patch over s0 ≤ s ≤ s1, t0 ≤ t ≤ t1, as a patch: exactly the same points.

        Raises
        ------
        InputError
            If this is not a rectangle inside [0, 1]².
        """
        if not (0.0 <= s0 < s1 <= 1.0 and 0.0 <= t0 < t1 <= 1.0):
            raise InputError(f"part from s={s0}, t={t0} to s={s1}, t={t1}; allowed: rising, within 0 to 1")
        part = self
        for name, low, high in (("s", s0, s1), ("t", t0, t1)):
            if high < 1.0:
                part = part.split(**{name: high})[0]
            if low > 0.0:
                part = part.split(**{name: low / high})[1]
        return part

    def elevate(self, m: int, n: int) -> "RationalPatch":
        """Return the same patch with a net of the higher degree (m, n).

        Raises
        ------
        InputError
            If m or n is below the patch's own degree or above 32.
        """
        if not (self.degree[0] <= m <= MAX_DEGREE and self.degree[1] <= n <= MAX_DEGREE):
            raise InputError(
                f"elevate to degree ({m}, {n}); allowed: {self.degree} to ({MAX_DEGREE}, {MAX_DEGREE})"
            )
        return RationalPatch(elevate_axis(elevate_axis(self.net, m).swapaxes(0, 1), n).swapaxes(0, 1))

    def reverse(self, axis: int) -> "RationalPatch":
        """Return the patch with s (axis 0) or t (axis 1) reversed; its normals flip.

        Raises
        ------
        InputError
            If axis is neither 0 nor 1.
        """
        if axis not in (0, 1):
            raise InputError(f"axis is {axis}; allowed: 0 (s) or 1 (t)")
        return RationalPatch(np.flip(self.net, axis))

    def transpose(self) -> "RationalPatch":
        """Return the patch with s and t exchanged; its normals flip."""
        return RationalPatch(self.net.swapaxes(0, 1))

    def edge(self, edge: int) -> FloatArray:
        """Return the homogeneous control net (d+1, 4) of an edge, along its own parameter (CONVENTIONS.md).

        Raises
        ------
        InputError
            If edge is not 0 (s = 0), 1 (t = 1), 2 (s = 1) or 3 (t = 0).
        """
        if edge not in (0, 1, 2, 3):
            raise InputError(f"edge is {edge}; allowed: 0 (s = 0), 1 (t = 1), 2 (s = 1), 3 (t = 0)")
        return (self.net[0], self.net[:, -1], self.net[-1], self.net[:, 0])[edge]

    def _grid(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """Return points and derivatives on a grid, shape (S, T, 3, 3)."""
        out = np.empty((len(s), len(t), 3, 3))
        net = np.array(self.net)  # writeable as above
        _in_parts(len(s), len(s) * len(t), lambda a, b: evaluate(net, s[a:b], t, True, out[a:b]))
        return out

    def _scattered(self, s: FloatArray, t: FloatArray) -> FloatArray:
        """Return points and derivatives at scattered parameters (N,), shape (N, 3, 3)."""
        out = np.empty((len(s), 1, 3, 3))
        net = np.array(self.net)
        _in_parts(len(s), len(s), lambda a, b: evaluate(net, s[a:b], t[a:b], False, out[a:b]))
        return out[:, 0]


def _in_parts(length: int, points: int, work: Callable[[int, int], None]) -> None:
    """Call ``work(first, last)`` over 0…length: at once, or in several threads if there are many points."""
    if points < MANY:
        work(0, length)
        return
    parts = min(length, thread_count())
    cuts = [length * k // parts for k in range(parts + 1)]
    run_tasks([partial(work, a, b) for a, b in pairwise(cuts)])


def parameter_list(name: str, values: ArrayLike) -> FloatArray:
    """Return a list of parameters as a new float64 array (n,).

    Raises
    ------
    InputError
        If it is not a list of finite numbers; names it.
    """
    return _parameters(name, values, 1)


def _parameters(name: str, values: ArrayLike, ndim: int | None = None) -> FloatArray:
    """Return `values` as a new contiguous float64 array, checked to be finite numbers."""
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be an array of numbers: {error}") from None
    if ndim is not None and array.ndim != ndim:
        raise InputError(f"{name} has {array.ndim} dimensions; allowed: {ndim}")
    if not np.isfinite(array).all():
        raise InputError(
            f"{name} holds numbers that are not finite; allowed: finite parameters, 0 to 1 on the patch"
        )
    return array


def parameter_pairs(s: ArrayLike, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return s and t as new float64 arrays of one shape.

    Raises
    ------
    InputError
        If they are not finite numbers of one shape.
    """
    s, t = _parameters("s", s), _parameters("t", t)
    if s.shape != t.shape:
        raise InputError(f"s has shape {s.shape} and t {t.shape}; allowed: equal shapes")
    return s, t


def _outside(net: FloatArray) -> InputError:
    # The error for a net with an invalid number: names the first one.
    weights = net[..., 3]
    ok = (weights >= 1 / LARGEST) & (weights <= LARGEST)  # false for NaN too
    if not ok.all():
        i, j = np.argwhere(~ok)[0]
        return InputError(
            f"weight [{i}, {j}] is {weights[i, j]:.17g}; allowed: positive, {1 / LARGEST:g} to {LARGEST:g}"
        )
    i, j = np.argwhere(~(np.abs(net[..., :3]).max(axis=2) <= LARGEST))[0]
    return InputError(
        f"control point [{i}, {j}] is ({_numbers(net[i, j, :3])}), times its weight; "
        f"allowed: finite numbers up to {LARGEST:g}"
    )


def _numbers(values: FloatArray) -> str:
    """Write a few numbers for an error message."""
    return ", ".join(f"{value:.6g}" for value in values)
