"""A chart: the grid of steps laid over a part of a surface."""

from dataclasses import dataclass

__all__ = ["MAX_CHART", "MAX_TEXELS", "Chart"]

MAX_CHART = 16384
"""Greatest number of steps or texels of a chart, each way."""

MAX_TEXELS = 2**31
"""Greatest number of texels of a layout."""


@dataclass(frozen=True, slots=True)
class Chart:
    """The grid of steps laid over a rectangle of one face's parameters, across its patches; or of texels.

    Attributes
    ----------
    face
        Index of the face in its surface.
    height, width
        Number of steps each way: rows run along s, columns along t.
    s0, s1, t0, t1
        The rectangle of parameters that the chart covers; step (r, c) is at
        ``s0 + (s1 - s0)·(r + ½)/height``, ``t0 + (t1 - t0)·(c + ½)/width``.
    """

    face: int
    height: int
    width: int
    s0: float = 0.0
    s1: float = 1.0
    t0: float = 0.0
    t1: float = 1.0
