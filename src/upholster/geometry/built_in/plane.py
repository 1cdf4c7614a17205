"""The plane rectangle."""

import numpy as np

from upholster.base.errors import InputError
from upholster.geometry.built_in.parameter_checks import check_length, check_spans
from upholster.geometry.patches.face import grid_face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["plane"]


def plane(width: float = 1.0, height: float = 1.0, *, spans: tuple[int, int] = (1, 1)) -> Surface:
    """Build a rectangle round the origin in the plane z = 0, seen from +z: columns along +x, rows along −y.

    Parameters
    ----------
    width, height
        Extent along x and along y, in the model's units: 1e-9 to 1e9.
    spans
        Bi-linear patches along the rows' direction (−y) and along the columns' (+x): 1 to 256 each.

    Raises
    ------
    InputError
        If a parameter is outside its range.
    """
    width, height = check_length("width", width), check_length("height", height)
    if not (isinstance(spans, tuple | list) and len(spans) == 2):
        raise InputError(f"spans is {spans}; allowed: two whole numbers from 1 to 256")
    rows = check_spans("spans along y", spans[0], least=1)
    columns = check_spans("spans along x", spans[1], least=1)
    x = width * (np.arange(columns + 1) / columns - 0.5)
    y = height * (0.5 - np.arange(rows + 1) / rows)
    grid = np.stack([*np.meshgrid(x, y), np.zeros((rows + 1, columns + 1))], axis=-1)
    patches = [
        RationalPatch.from_points(grid[i : i + 2, j : j + 2]) for i in range(rows) for j in range(columns)
    ]
    face = grid_face(patches, columns)
    return Surface.built_in("plane", [face], width=width, height=height, spans=(rows, columns))
