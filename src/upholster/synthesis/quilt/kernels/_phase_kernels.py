"""How well a source's phases fit those that the surface requests at a block."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import int64, uint64
from upholster.runtime.jit import inline
from upholster.synthesis.quilt.kernels._block_kernels import ChoiceScratch, MatchImage

__all__ = ["MISFIT", "list_misfits", "misfit", "want_phases"]

MISFIT = 2**14
"""The value of `misfit` for a wave that is a quarter turn off."""

_STEPS = 1024

# No value is near a tie of rounding, so every machine's cosine gives the same numbers.
_MISFITS = np.rint(MISFIT * (1 - np.cos(2 * np.pi * np.arange(_STEPS) / _STEPS))).astype(np.int32)


@inline
def want_phases(match: MatchImage, phases: NDArray[np.int32], symmetry: int, choice: ChoiceScratch) -> None:
    """Enter the requested phases of a block with a symmetry; `phases` are its centre's, in 1/65536 turn."""
    row = 8 * max(0, choice.zone[0] - 1) + symmetry
    for k in range(match.phases.shape[0]):
        seen = int64(match.shown[row, k])
        choice.wanted[k, 0] = abs(seen) - 1
        choice.wanted[k, 1] = 1 if seen > 0 else -1
        choice.wanted[k, 2] = phases[k]


@inline
def misfit(phases: NDArray[np.int16], wanted: NDArray[np.int64], place: int) -> Any:
    """Return the sum over all waves of 1 - cos(phase at a place - wanted phase), in 1/`MISFIT`.

    A wave that the symmetry does not show counts as a quarter turn off, which is the mean over all sources.
    """
    total = int64(0)
    for k in range(phases.shape[0]):
        if wanted[k, 0] < 0:
            total += MISFIT
        else:
            away = wanted[k, 1] * phases[wanted[k, 0], place] - wanted[k, 2]
            total += _MISFITS[((away + 32) >> 6) & (_STEPS - 1)]
    return total


@inline
def list_misfits(
    phases: NDArray[np.int16], wanted: NDArray[np.int64], place: int, step: int, out: NDArray[np.int32]
) -> None:
    """Write the `misfit` of every `step`-th place from `place` on, in 32 bits for several at a time."""
    for n in range(out.shape[0]):
        out[n] = 0
    for k in range(phases.shape[0]):
        if wanted[k, 0] < 0:
            for n in range(out.shape[0]):
                out[n] += np.int32(MISFIT)
        else:
            line = phases[wanted[k, 0], place:]
            sign, shift = np.int32(wanted[k, 1]), np.int32(32 - wanted[k, 2])
            for n in range(out.shape[0]):
                away = np.int32(np.int32(sign * np.int32(line[uint64(n * step)])) + shift)
                out[n] += _MISFITS[uint64((away >> np.int32(6)) & np.int32(_STEPS - 1))]
