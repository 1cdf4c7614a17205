"""Splitting vertices of a primitive that need several texture coordinates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray

__all__ = ["SplitVertices", "split_vertices"]


@dataclass(frozen=True, eq=False)
class SplitVertices:
    """New vertices of a primitive.

    Attributes
    ----------
    source
        (W,) int64: the old vertex of each.
    uv
        (W, 2) float32.
    triangles
        (n, 3) int32: the new vertices of each triangle's corners.
    """

    source: NDArray[np.int64]
    uv: NDArray[np.float32]
    triangles: IntArray


def split_vertices(
    corners: IntArray, uv: NDArray[np.floating], count: int, *, all_vertices: bool
) -> SplitVertices:
    """Assign texture coordinates to vertices; a vertex that needs several is split.

    Parameters
    ----------
    corners
        (n, 3) old vertices of each triangle's corners.
    uv
        (n, 3, 2) texture coordinates there.
    count
        Number of old vertices.
    all_vertices
        Whether every old vertex stays where it is, used or not, and further ones follow. Otherwise only the
        vertices that triangles use remain, in their order.

    Returns
    -------
    SplitVertices
        Corners share a vertex if they did before and have equal texture coordinates in single precision.
    """
    old = corners.reshape(-1).astype(np.int64)
    single = np.ascontiguousarray(uv.reshape(-1, 2), np.float32) + np.float32(0)  # -0 is 0
    code = single.view(np.int64).reshape(-1)
    order = np.lexsort((code, old))
    ranked, codes = old[order], code[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (ranked[1:] != ranked[:-1]) | (codes[1:] != codes[:-1])
    variant = np.empty(len(order), np.int64)
    variant[order] = np.cumsum(starts) - 1
    source, coordinates = ranked[starts], single[order][starts]
    if all_vertices:
        first = np.ones(len(source), bool)
        first[1:] = source[1:] != source[:-1]
        place = np.where(first, source, count + np.cumsum(~first) - 1)
        whole = np.arange(count + int((~first).sum()))
        whole[place] = source
        spread = np.zeros((len(whole), 2), np.float32)
        spread[place] = coordinates
        source, coordinates, variant = whole, spread, place[variant]
    return SplitVertices(source, coordinates, variant.reshape(-1, 3).astype(np.int32))
