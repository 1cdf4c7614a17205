"""The result of a synthesis: charts, ordered placements, and the texels that painting them gives.

A *quilt* says where each block of texture comes from; it holds no colour. `upholster.synthesis.paint` turns a
quilt and an exemplar into *texels*. Words and the exact meaning of a placement: CONVENTIONS.md.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.types import PixelArray

__all__ = ["MASK_CUT", "MASK_NONE", "MASK_RAMP", "PLACEMENT", "SIDE_LEFT", "SIDE_TOP", "Chart", "Quilt", "Texels"]

MASK_NONE, MASK_RAMP, MASK_CUT = 0, 1, 2
SIDE_TOP, SIDE_LEFT = 1, 2

PLACEMENT = np.dtype(
    [
        ("chart", np.int32),
        ("row", np.int32),  # centre of the target rectangle, in texels of the chart
        ("column", np.int32),
        ("height", np.int32),  # of the target rectangle, which may reach beyond the chart: clipped
        ("width", np.int32),
        ("source_row", np.int32),  # where the centre falls in the exemplar, in 1/16 pixel
        ("source_column", np.int32),
        ("cells", np.int32),  # MASK_CUT: where its cells start in `Quilt.cells`, else -1
        ("turn", np.uint8),  # symmetry of the square that takes chart steps to exemplar steps, 0…7
        ("mask", np.uint8),  # MASK_NONE, MASK_RAMP or MASK_CUT
        ("sides", np.uint8),  # MASK_RAMP: which sides are blended, SIDE_TOP | SIDE_LEFT
        ("ramp", np.uint8),  # MASK_RAMP: width of the ramp in texels
        ("cell", np.uint8),  # MASK_CUT: size of a cell in texels
        ("feather", np.uint8),  # MASK_CUT: smoothing passes
    ],
    align=True,
)


@dataclass(frozen=True, slots=True)
class Chart:
    """The texel grid laid over a rectangle of one patch's parameters.

    Attributes
    ----------
    patch
        Index of the patch in its surface.
    height, width
        Size in texels: rows go with s, columns with t.
    s0, s1, t0, t1
        The rectangle of parameters that the chart covers; texel (r, c) lies at
        ``s0 + (s1 - s0)·(r + ½)/height``, ``t0 + (t1 - t0)·(c + ½)/width``.
    """

    patch: int
    height: int
    width: int
    s0: float = 0.0
    s1: float = 1.0
    t0: float = 0.0
    t1: float = 1.0


@dataclass(frozen=True)
class Texels:
    """What painting gives: one array per chart.

    Attributes
    ----------
    charts
        The layout.
    arrays
        One (height, width, channels) array per chart, of the exemplar's dtype.
    """

    charts: tuple[Chart, ...]
    arrays: tuple[PixelArray, ...]

    @property
    def count(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)

    @property
    def nbytes(self) -> int:
        """Bytes that the arrays take."""
        return sum(array.nbytes for array in self.arrays)


@dataclass(frozen=True)
class Quilt:
    """Charts and ordered placements: the whole result of a synthesis.

    Attributes
    ----------
    charts
        The layout.
    exemplar_shape
        (height, width) in pixels of the exemplar that it was made from; any image of this shape can be painted.
    placements
        Structured array of `PLACEMENT`, read-only, in painting order.
    cells
        uint8, read-only: the cut masks' cells, 1 = new, row by row, one mask after another.
    """

    charts: tuple[Chart, ...]
    exemplar_shape: tuple[int, int]
    placements: NDArray[np.void]
    cells: NDArray[np.uint8]

    @cached_property
    def texel_count(self) -> int:
        """Number of texels over all charts."""
        return sum(chart.height * chart.width for chart in self.charts)
