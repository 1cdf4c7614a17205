"""The smoothest field on the triangles, with or without a direction that it shall have.

References
----------
F. Knöppel, K. Crane, U. Pinkall, P. Schröder: Globally optimal direction fields, ACM Transactions on Graphics
32, 2013: energy of equation 5 with s = 0, the smallest eigenvector (algorithm 2), alignment (section 3.3).
Here the unknowns are on triangles, so that creases are edges over which nothing is carried.
"""

import numpy as np

from upholster.charts._multigrid_kernels import ComplexArray, Rows
from upholster.charts.mesh_directions.frames import PlaneFrames, power
from upholster.charts.multigrid import Multigrid, hermitian, smallest_eigenvectors, solve
from upholster.types import FloatArray

__all__ = ["field_power", "spread_evenly"]

_REACH = 0.05
"""Length, as a part of the model's size, over which a wish of half confidence gives way to smoothness."""

_EVENING = 0.1
"""Length, as a part of the model's size, up to which singular points of opposite index cancel out."""

_ROUNDS = 3
"""How often the field is made unit and smooth again."""

_LEAST = 1e-3
"""Part of a region's area that must have a wish, for the region to follow it."""


def field_power(
    frames: PlaneFrames,
    wish: ComplexArray,
    confidence: FloatArray,
    prior: ComplexArray,
    symmetry: int,
    size: float,
) -> ComplexArray:
    """Return the field's power z^symmetry on each triangle, of size 1.

    Parameters
    ----------
    frames
        The triangles.
    wish
        (T,) the power that is asked for, of size 1 where `confidence` is above 0.
    confidence
        (T,) 0 to 1: 1 is followed closely, 0 not at all.
    prior
        (T,) a power of any size: what a region without wishes resembles, where smoothness leaves a choice.
    symmetry
        1, 2 or 4.
    size
        The model's.
    """
    rows = _energy(frames, symmetry)
    total = np.bincount(frames.part, frames.areas, frames.parts)
    heard = np.bincount(frames.part, frames.areas * confidence, frames.parts) > _LEAST * total
    confidence = np.where(heard[frames.part], confidence, 0.0)
    force = frames.areas / (_REACH * size) ** 2 * confidence / (1.0001 - confidence)
    z = np.where(heard[frames.part], wish, 0.0)
    if heard.any():
        z = _filled(rows, frames.areas, force, wish)
    if not heard.all():
        start = np.where(heard[frames.part], 0.0, prior)
        free = smallest_eigenvectors(rows, frames.areas, frames.part, start, shift=0.1 / total)
        z = np.where(heard[frames.part], z, _turned_to(frames, free, prior))
    return _evened(rows, frames.areas, force, wish, z, size)


def spread_evenly(frames: PlaneFrames, z: ComplexArray, symmetry: int, length: float) -> ComplexArray:
    """Return a field of powers (T,) averaged over a length, within each region."""
    rows, mass = _energy(frames, symmetry), frames.areas / length**2
    return solve(Multigrid(rows._replace(diagonal=rows.diagonal + mass)), mass * z, z, tolerance=1e-3)


def _energy(frames: PlaneFrames, symmetry: int) -> Rows:
    """Return the matrix of Σ weight·|z_second − carried·z_first|²."""
    diagonal = np.zeros(len(frames.areas))
    for end in (frames.first, frames.second):
        diagonal += np.bincount(end, frames.weights, len(diagonal))
    # Row `first`, column `second`.
    values = power(frames.carried, symmetry).conj()
    return hermitian(len(diagonal), frames.first, frames.second, -frames.weights * values, diagonal)


def _filled(rows: Rows, areas: FloatArray, force: FloatArray, wish: ComplexArray) -> ComplexArray:
    """Return the field that is smooth and follows the wishes, each with its force."""
    # A trace everywhere keeps regions without wishes solvable.
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + force + 1e-9 * areas / areas.max()))
    return solve(grid, force * wish, np.where(force > 0, wish, 0.0), tolerance=1e-6)


def _evened(
    rows: Rows, areas: FloatArray, force: FloatArray, wish: ComplexArray, z: ComplexArray, size: float
) -> ComplexArray:
    """Return the field made unit and smooth by turns: singular points that need not be cancel out.

    The smallest eigenvector is long where the surface is flat and next to nothing elsewhere, and a field
    filled from afar is faint; there the unit field may have pairs of singular points.

    References
    ----------
    R. Viertel, B. Osting: An approach to quad meshing based on harmonic cross-valued maps and the
    Ginzburg-Landau theory, SIAM Journal on Scientific Computing 41, 2019, algorithm 1.
    """
    pull = areas / (_EVENING * size) ** 2
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + force + pull))
    for _ in range(_ROUNDS):
        z = _unit(z)
        z = solve(grid, force * wish + pull * z, z, tolerance=0.02)
    return _unit(z)


def _unit(z: ComplexArray) -> ComplexArray:
    length = np.sqrt(z.real**2 + z.imag**2)
    unit: ComplexArray = np.where(length > 0, z / np.where(length > 0, length, 1.0), 1.0)
    return unit


def _turned_to(frames: PlaneFrames, z: ComplexArray, prior: ComplexArray) -> ComplexArray:
    """Turn the field of each region as a whole to where it is most like the prior."""
    like = np.conj(z) * prior * frames.areas
    real, imaginary = (np.bincount(frames.part, part, frames.parts) for part in (like.real, like.imag))
    length = np.sqrt(real**2 + imaginary**2)
    turn = np.where(length > 0, (real + 1j * imaginary) / np.where(length > 0, length, 1.0), 1.0)
    return z * turn[frames.part]
