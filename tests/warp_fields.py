"""Warp fields of given matrices."""

import numpy as np
from numpy.typing import ArrayLike

from upholster.quilt.warp_field import WarpField, polar_nodes


def quantised(matrices: ArrayLike, *, margin: int = 1) -> WarpField:
    """Return the field nearest to matrices (rows, columns, 2, 2), exemplar pixels per texel."""
    return WarpField(polar_nodes(np.asarray(matrices, np.float64)), margin)
