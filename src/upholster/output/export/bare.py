"""OBJ and PLY with triangles only, without texture."""

import io
import os

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.base.files import writing
from upholster.base.types import FloatArray, IntArray

__all__ = ["write_bare_obj", "write_bare_ply"]

_ROWS = 1 << 15
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_bare_obj(
    path: str | os.PathLike[str], positions: FloatArray, triangles: IntArray, *, name: str = "model"
) -> None:
    """Write triangles as OBJ without material. The y axis is up: (x, y, z) is written as (x, z, -y).

    Parameters
    ----------
    path
        The file.
    positions, triangles
        (V, 3), of which nine digits are written, and (T, 3): counter-clockwise seen from outside.
    name
        The object's name.
    """
    turned = positions @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) + 0.0
    with writing(path) as opened, io.TextIOWrapper(opened, "utf-8", newline="\n") as file:
        file.write(f"# upholster {__version__}\no {'_'.join(name.split()) or 'model'}\n")
        rows: tuple[tuple[str, NDArray[np.generic]], ...] = (
            ("v %.9g %.9g %.9g\n", turned),
            ("f %d %d %d\n", triangles + 1),
        )
        for form, values in rows:
            for start in range(0, len(values), _ROWS):
                part = values[start : start + _ROWS]
                file.write(form * len(part) % tuple(part.ravel().tolist()))


def write_bare_ply(path: str | os.PathLike[str], positions: FloatArray, triangles: IntArray) -> None:
    """Write triangles as binary PLY; axes are as they are.

    Parameters
    ----------
    path
        The file.
    positions, triangles
        (V, 3), rounded to single precision, and (T, 3): counter-clockwise seen from outside.

    References
    ----------
    G. Turk: The PLY polygon file format, 1994.
    """
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment upholster {__version__}\n"
        f"element vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(triangles), _FACE)
    faces["count"] = 3
    faces["corners"] = triangles
    with writing(path) as file:
        file.write(header.encode("ascii"))
        file.write(positions.astype("<f4").tobytes())
        file.write(faces.tobytes())
