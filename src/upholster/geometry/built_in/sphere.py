"""The sphere, exactly: six bi-quartic patches without poles, or eight bi-quadratic octants."""

import math
from typing import Literal

import numpy as np

from upholster.base.errors import InputError, nearest
from upholster.base.types import FloatArray
from upholster.geometry.built_in.parameter_checks import check_length
from upholster.geometry.built_in.revolution import half_circle, revolve
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["sphere"]

FACES = (
    # right, down, outward, as seen from outside: four round the equator, then top and bottom
    ((0, 1, 0), (0, 0, -1), (1, 0, 0)),
    ((-1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ((0, -1, 0), (0, 0, -1), (-1, 0, 0)),
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
)


def sphere(r: float = 1.0, *, tiling: Literal["six", "octants"] = "six") -> Surface:
    """Build the sphere round the origin.

    Parameters
    ----------
    r
        Radius, in the model's units.
    tiling
        ``"six"``: six faces of one bi-quartic patch, one per face of a cube (+x, +y, −x, −y, top, bottom),
        nowhere degenerate. ``"octants"``: one face of eight bi-quadratic patches, four round the northern
        half and four round the southern, degenerate at the poles.

    Raises
    ------
    InputError
        If the radius is outside 1e-9 to 1e9 or the tiling is unknown.

    References
    ----------
    Six patches: J. E. Cobb, *Tiling the sphere with rational Bézier patches*, TR UUCS-88-009, University of
    Utah, 1988.
    """
    r = check_length("r", r)
    if not isinstance(tiling, str) or tiling not in ("six", "octants"):
        raise InputError(f"tiling is {tiling!r}; {nearest(str(tiling), ('six', 'octants'))}")
    if tiling == "octants":
        return Surface.built_in("sphere", revolve(half_circle(r)).faces, r=r, tiling=tiling)
    net = _cobb_face()
    patches = []
    for frame in FACES:
        face = np.empty_like(net)
        face[..., :3] = r * (net[..., :3] @ np.array(frame, dtype=np.float64))
        face[..., 3] = net[..., 3]
        patches.append(RationalPatch(face))
    return Surface.built_in("sphere", patches, r=r, tiling=tiling)


def _cobb_face() -> FloatArray:
    """Return Cobb's net of one face of the unit sphere, (right, down, outward, 1)·w, shape (5, 5, 4).

    Only the quarter towards low i and j is tabulated; the rest mirrors it.
    """
    r2, r3, r6 = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(6.0)
    # corner, next to the corner, middle of the edge; inside, inside the middle of the edge, centre
    low = 4.0 * (1.0 - r3)
    near, far = -r2, r2 * (r3 - 4.0)
    edge = 4.0 * (1.0 - 2.0 * r3) / 3.0
    inner = (2.0 - 3.0 * r3) / 2.0
    middle = r2 * (2.0 * r3 - 7.0) / 3.0
    quarter = {
        (0, 0): (low, low, -low, 4.0 * (3.0 - r3)),
        (0, 1): (near, far, -far, r2 * (3.0 * r3 - 2.0)),
        (0, 2): (0.0, edge, -edge, 4.0 * (5.0 - r3) / 3.0),
        (1, 1): (inner, inner, (r3 + 6.0) / 2.0, (r3 + 6.0) / 2.0),
        (1, 2): (0.0, middle, 5.0 * r6 / 3.0, r2 * (r3 + 6.0) / 3.0),
        (2, 2): (0.0, 0.0, 4.0 * (5.0 - r3) / 3.0, 4.0 * (5.0 * r3 - 1.0) / 9.0),
    }
    net = np.empty((5, 5, 4))
    for i in range(5):
        for j in range(5):
            p, q = min(i, 4 - i), min(j, 4 - j)
            x, y, z, w = quarter[min(p, q), max(p, q)]
            if p > q:
                x, y = y, x
            net[i, j] = (x if j <= 2 else -x, y if i <= 2 else -y, z, w)
    return net
