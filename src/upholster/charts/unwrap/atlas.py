"""Charts of a mesh by xatlas, a library that is installed on demand."""

from typing import Any

import numpy as np

from upholster.errors import InputError
from upholster.types import FloatArray, IntArray

__all__ = ["atlas_charts"]


def atlas_charts(positions: FloatArray, triangles: IntArray) -> tuple[IntArray, FloatArray]:
    """Cut triangles into charts and lay these out flat.

    Parameters
    ----------
    positions
        (V, 3), of a size near 1.
    triangles
        (T, 3).

    Returns
    -------
    chart
        (T,) int32: 0 to the charts' number less 1; −1 where xatlas took no part of a triangle.
    corners
        (T, 3, 2) float64: its texture coordinates, of any scale and either orientation.

    Raises
    ------
    InputError
        If xatlas is missing.
    """
    xatlas = _xatlas()
    atlas = xatlas.Atlas()
    atlas.add_mesh(positions.astype(np.float32), triangles.astype(np.uint32))
    packing = xatlas.PackOptions()
    packing.resolution, packing.rotate_charts = 256, False  # packing is done anew, so any will do
    atlas.generate(xatlas.ChartOptions(), packing)
    chart = np.full(len(triangles), -1, np.int32)
    for number in range(atlas.get_mesh_chart_count(0)):
        chart[atlas.get_mesh_chart(0, number).faces] = number
    _, vertices, uv = atlas[0]
    return chart, uv[vertices].astype(np.float64)


def _xatlas() -> Any:
    try:
        import xatlas
    except ImportError as error:
        raise InputError(
            "charts of a mesh need xatlas; install it with: pip install 'upholster[mesh]'"
        ) from error
    return xatlas
