"""Which texels continue one another verbatim: how much of the exemplar is repeated unbroken."""

from dataclasses import dataclass

import numpy as np

from upholster.errors import InputError
from upholster.measure._kernels import largest_copied_square
from upholster.measure.trace import traces
from upholster.quilt import Quilt

__all__ = ["Copies", "copies"]


@dataclass(frozen=True, slots=True)
class Copies:
    """How much of a quilt is verbatim continuation.

    Attributes
    ----------
    ratio
        Share of the pairs of neighbouring texels (right and lower) that are neighbours in the exemplar too,
        0 to 1. A quilt of whole b×b blocks has at least 1 − 1/b.
    longest
        Largest side, in texels, of a square that is copied unbroken.
    """

    ratio: float
    longest: int


def copies(quilt: Quilt) -> Copies:
    """Measure how much of a quilt is verbatim continuation of the exemplar.

    A texel belongs to the placement that shows in its cell. Two neighbouring texels are a verbatim
    continuation if one placement paints both. They also are if both of their placements map the second texel
    to the same place of the exemplar, within ½ pixel each way (through the chart's warp field, and by the
    same symmetry of the square). Measured on at most 8 Mtexels, in windows of at most 2048², which also
    limits the longest repeat.

    Parameters
    ----------
    quilt
        The result of a synthesis.

    Returns
    -------
    Copies
        Ratio and longest repeat.

    Raises
    ------
    InputError
        If no texel of the quilt has a neighbour.

    References
    ----------
    Ashikhmin: Synthesizing natural textures, I3D 2001, on verbatim copying, the tendency of pixel methods.
    """
    pairs, continued, longest = 0, 0, 0
    for trace in traces(quilt):
        below, right = trace.links(0), trace.links(1)
        shown = trace.owners >= 0
        pairs += int((shown[1:] & shown[:-1]).sum()) + int((shown[:, 1:] & shown[:, :-1]).sum())
        continued += int(np.count_nonzero(below)) + int(np.count_nonzero(right))
        scratch = np.zeros(trace.window.width, np.int32)
        longest = max(longest, int(largest_copied_square(shown, below, right, scratch)))
    if not pairs:
        raise InputError("quilt has no neighbouring texels; allowed: charts of at least 1×2 texels")
    return Copies(continued / pairs, longest)
