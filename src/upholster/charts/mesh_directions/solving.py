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

__all__ = ["field_power"]

_REACH = 0.05
"""Length, as a part of the model's size, over which a wish of half confidence gives way to smoothness."""

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
    z = np.where(confidence > 0, wish, prior)
    if heard.any() and (confidence[heard[frames.part]] < 1).any():
        z = _filled(rows, frames, wish, np.where(heard[frames.part], confidence, 0.0), size)
    if not heard.all():
        free = smallest_eigenvectors(
            rows, frames.areas, frames.part, np.where(heard[frames.part], 0, prior), shift=0.1 / total
        )
        free = _turned_to(frames, free, prior)
        z = np.where(heard[frames.part], z, free)
    length = np.sqrt(z.real**2 + z.imag**2)
    return np.where(length > 0, z / np.where(length > 0, length, 1.0), 1.0)


def _energy(frames: PlaneFrames, symmetry: int) -> Rows:
    """Return the matrix of Σ weight·|z_second − carried·z_first|²."""
    diagonal = np.zeros(len(frames.areas))
    for end in (frames.first, frames.second):
        diagonal += np.bincount(end, frames.weights, len(diagonal))
    # Row `first`, column `second`.
    values = power(frames.carried, symmetry).conj()
    return hermitian(len(diagonal), frames.first, frames.second, -frames.weights * values, diagonal)


def _filled(
    rows: Rows, frames: PlaneFrames, wish: ComplexArray, confidence: FloatArray, size: float
) -> ComplexArray:
    """Return the field that is smooth and follows the wishes, each with the force of its confidence."""
    force = frames.areas / (_REACH * size) ** 2 * confidence / (1.0001 - confidence)
    # A trace everywhere keeps regions without wishes solvable.
    force = force + 1e-9 * frames.areas / frames.areas.max()
    grid = Multigrid(rows._replace(diagonal=rows.diagonal + force))
    return solve(grid, force * wish, np.where(confidence > 0, wish, 0.0), tolerance=1e-6)


def _turned_to(frames: PlaneFrames, z: ComplexArray, prior: ComplexArray) -> ComplexArray:
    """Turn the field of each region as a whole to where it is most like the prior."""
    like = np.conj(z) * prior * frames.areas
    real, imaginary = (np.bincount(frames.part, part, frames.parts) for part in (like.real, like.imag))
    length = np.sqrt(real**2 + imaginary**2)
    turn = np.where(length > 0, (real + 1j * imaginary) / np.where(length > 0, length, 1.0), 1.0)
    return z * turn[frames.part]
