"""STL with triangles only, for slicers."""

import os

import numpy as np

from upholster._version import __version__
from upholster.base.files import writing
from upholster.base.types import FloatArray, IntArray

__all__ = ["write_stl"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
_BATCH = 1 << 18


def write_stl(path: str | os.PathLike[str], positions: FloatArray, triangles: IntArray) -> None:
    """Write triangles as binary STL: z is up, and programs read the numbers as millimetres.

    Vertices that triangles share are identical to the bit in each of them.

    Parameters
    ----------
    path
        The file.
    positions, triangles
        (V, 3), rounded to single precision, and (T, 3): counter-clockwise seen from outside.

    References
    ----------
    M. Burns: Automated Fabrication, 1993, section 6.5. (The StL format.)
    """
    points = positions.astype(np.float32)
    with writing(path) as file:
        # Its first word must not be "solid", which marks the text form.
        file.write(f"upholster {__version__}".encode("ascii").ljust(80))
        file.write(np.uint32(len(triangles)).astype("<u4").tobytes())
        for start in range(0, len(triangles), _BATCH):
            corners = points[triangles[start : start + _BATCH]]
            wide = corners.astype(np.float64)
            crossed = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
            length = np.linalg.norm(crossed, axis=1, keepdims=True)
            records = np.zeros(len(corners), _RECORD)
            records["normal"] = np.divide(crossed, length, out=crossed, where=length > 0)
            records["corners"] = corners
            file.write(records.tobytes())
