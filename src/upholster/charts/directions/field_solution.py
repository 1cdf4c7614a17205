"""The smoothest field on the triangles, with or without directions to follow.

References
----------
F. Knöppel, K. Crane, U. Pinkall, P. Schröder: Globally optimal direction fields, ACM Transactions on Graphics
32, 2013: energy of equation 5 with s = 0, the smallest eigenvector (algorithm 2), alignment (section 3.3).
Here the unknowns are on triangles, so that creases are edges that no direction crosses.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import ComplexArray, FloatArray, IntArray
from upholster.charts._multigrid_kernels import Rows
from upholster.charts.directions.frames import PlaneFrames, power
from upholster.charts.multigrid import Multigrid, hermitian, smallest_eigenvectors, solve, unit_complex

__all__ = ["field_power", "followed", "spread_evenly"]

_REACH = 0.05
"""Length, as a share of the model's size, over which a request of half confidence yields to smoothness."""

_EVENING = 0.1
"""Length, as a share of the model's size, up to which singular points of opposite index cancel out."""

_ROUNDS = 3
"""Rounds in which the field is normalized and smoothed again."""


def field_power(
    frames: PlaneFrames,
    request: ComplexArray,
    confidence: FloatArray,
    prior: ComplexArray,
    symmetry: int,
    size: float,
    least: float,
) -> ComplexArray:
    """Return the field's power z^symmetry on each triangle, of size 1.

    Parameters
    ----------
    frames
        The triangles.
    request
        (T,) the power asked for, of size 1 where `confidence` is above 0.
    confidence
        (T,) 0 to 1: 1 is followed closely, 0 is ignored.
    prior
        (T,) powers of any size: where smoothness leaves a choice, a region without requests resembles these.
    symmetry
        1, 2 or 4.
    size
        The model's size.
    least
        A region follows its requests if they cover at least this share of its area.
    """
    rows = _energy(frames, symmetry)
    heard, force = _forces(frames, confidence, size, least)
    z = np.where(heard, request, 0.0)
    if heard.any():
        z = _filled(rows, frames.areas, force, request)
    free = ~heard
    if free.any():
        z[free] = _smoothest(frames, symmetry, free, prior[free])
    return _evened(rows, frames.areas, force, request, z, size)


def followed(
    frames: PlaneFrames, request: ComplexArray, confidence: FloatArray, size: float, least: float
) -> ComplexArray:
    """Return requests with their signs (T,), interpolated smoothly: longer where they agree.

    Parameters as for `field_power`. 0 in regions that have no request.
    """
    heard, force = _forces(frames, confidence, size, least)
    if not heard.any():
        return np.zeros(len(request), np.complex128)
    return np.where(heard, _filled(_energy(frames, 1), frames.areas, force, request, tolerance=0.01), 0.0)


def _forces(
    frames: PlaneFrames, confidence: FloatArray, size: float, least: float
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which triangles are in regions with a request, and how strongly each is pulled to its own."""
    total = np.bincount(frames.part, frames.areas, frames.parts)
    heard = np.bincount(frames.part, frames.areas * confidence, frames.parts) > least * total
    confidence = np.where(heard[frames.part], confidence, 0.0)
    force = frames.areas / (_REACH * size) ** 2 * confidence / (1.0001 - confidence)
    return heard[frames.part], force


def spread_evenly(frames: PlaneFrames, z: ComplexArray, symmetry: int, length: float) -> ComplexArray:
    """Return a field of powers (T,) averaged over a length, within each region."""
    rows, mass = _energy(frames, symmetry), frames.areas / length**2
    return solve(
        Multigrid(rows._replace(diagonal=rows.diagonal + mass)), mass * z, z, tolerance=0.02, most=12
    )


def _energy(frames: PlaneFrames, symmetry: int, within: NDArray[np.bool_] | None = None) -> Rows:
    """Return the matrix of Σ weight·|z_second − carried·z_first|², on the regions `within` if given."""
    first, second, carried, weights = frames.first, frames.second, frames.carried, frames.weights
    count = len(frames.areas)
    if within is not None:
        kept = within[first]
        number = np.cumsum(within, dtype=np.int32) - 1
        first, second, carried, weights = (
            number[first[kept]],
            number[second[kept]],
            carried[kept],
            weights[kept],
        )
        count = int(np.count_nonzero(within))
    diagonal = np.zeros(count)
    for end in (first, second):
        diagonal += np.bincount(end, weights, count)
    # Row `first`, column `second`.
    return hermitian(count, first, second, -weights * power(carried, symmetry).conj(), diagonal)


def _smoothest(
    frames: PlaneFrames, symmetry: int, free: NDArray[np.bool_], prior: ComplexArray
) -> ComplexArray:
    """Return the smoothest field of complete regions, (F,), rotated in each to be most like `prior`."""
    _, inverse = np.unique(frames.part[free], return_inverse=True)
    part: IntArray = inverse.astype(np.int32)
    areas = frames.areas[free]
    shift = 0.1 / np.bincount(part, areas)
    # Starting from the prior makes the result most like it.
    return smallest_eigenvectors(_energy(frames, symmetry, free), areas, part, prior, shift=shift)


def _filled(
    rows: Rows, areas: FloatArray, force: FloatArray, request: ComplexArray, tolerance: float = 1e-4
) -> ComplexArray:
    """Return the smooth field that follows the requests, each with its force."""
    # A tiny diagonal term keeps regions without requests solvable.
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + force + 1e-9 * areas / areas.max()))
    return solve(grid, force * request, np.where(force > 0, request, 0.0), tolerance=tolerance)


def _evened(
    rows: Rows, areas: FloatArray, force: FloatArray, request: ComplexArray, z: ComplexArray, size: float
) -> ComplexArray:
    """Alternate normalizing and smoothing the field, so that unnecessary singular points cancel out.

    The smallest eigenvector is long where the surface is flat and almost zero elsewhere, and a field filled
    from far away is faint. There the normalized field may have pairs of singular points.

    References
    ----------
    R. Viertel, B. Osting: An approach to quad meshing based on harmonic cross-valued maps and the
    Ginzburg-Landau theory, SIAM Journal on Scientific Computing 41, 2019, algorithm 1.
    """
    pull = areas / (_EVENING * size) ** 2
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + force + pull))
    for _ in range(_ROUNDS):
        z = unit_complex(z)
        z = solve(grid, force * request + pull * z, z, tolerance=0.02, most=6)
    return unit_complex(z)
