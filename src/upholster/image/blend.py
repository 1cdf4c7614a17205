"""Copying pieces of one image into another without a visible edge.

The differences between neighbouring pixels are copied, after P. Pérez, M. Gangnet and A. Blake (Poisson image
editing, ACM Transactions on Graphics 22, 2003). The pixel values are weighted in as well, after P. Bhat, B.
Curless, M. Cohen and L. Zitnick (Fourier analysis of the 2D screened Poisson equation for gradient domain
problems, ECCV 2008). So an edge is evened out near by, and not over all of a large hole.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import IntArray, PixelArray

__all__ = ["blended"]

_SOLVED = 8
"""Pixels: the longest reach that is solved at one level. A longer reach is solved first on planes of half the
size."""

_ROUNDS = 80
"""Rounds of Chebyshev's method on each level. They leave less than a five hundredth of an error that reaches
so far. Their number is fixed, and nothing is summed over all pixels, so all machines give the same result."""

Plane = NDArray[np.float32]


def blended(
    photo: PixelArray, hole: NDArray[np.bool_], source: PixelArray, places: IntArray, *, reach: float
) -> PixelArray:
    """Return a photo whose hole shows pixels of a source, with its edges evened out.

    Parameters
    ----------
    photo
        (h, w, C) uint8, uint16 or float32.
    hole
        (h, w): the pixels to replace. All others stay as they are.
    source
        (H, W, C) of the same dtype.
    places
        (h, w, 2): row and column in the source for each pixel of the hole. Entries elsewhere are ignored.
    reach
        Pixels over which a difference at an edge falls to a third.

    Returns
    -------
    ndarray
        (h, w, C). No value is outside the range of the photo around the hole and the source at these
        places.
    """
    out = photo.copy()
    last = np.array(source.shape[:2]) - 1
    rows, columns = np.moveaxis(np.clip(places, 0, last), 2, 0)
    for channel in range(photo.shape[2]):
        plane = source[:, :, channel].astype(np.float32)
        shown = np.where(hole, plane[rows, columns], photo[:, :, channel].astype(np.float32))
        steps = [_steps(plane, shown, hole, (rows, columns), axis) for axis in (0, 1)]
        evened = np.clip(shown + _correction(steps, hole, 1 / reach**2), shown.min(), shown.max())
        if out.dtype.kind != "f":
            evened = np.rint(evened)
        out[:, :, channel][hole] = evened[hole].astype(out.dtype)
    return out


def _steps(
    plane: Plane, shown: Plane, hole: NDArray[np.bool_], at: tuple[IntArray, IntArray], axis: int
) -> Plane:
    # For each pixel and the next one along an axis: how much larger the difference between them should be.
    # The wanted difference is that of the piece there, or the mean of two pieces; 0 where both pixels stay.
    size = plane.shape[axis]

    def difference(by: int) -> Plane:
        moved = [at[0], at[1]]
        moved[axis] = np.clip(at[axis] + by, 0, size - 1)
        found: Plane = plane[moved[0], moved[1]] - plane[at]
        return found

    first, second = _ends(axis)
    own, other = hole[first], hole[second]
    ahead, behind = difference(1)[first], -difference(-1)[second]
    wanted = np.where(own & other, 0.5 * (ahead + behind), np.where(own, ahead, behind))
    found: Plane = np.where(own | other, wanted - (shown[second] - shown[first]), 0.0).astype(np.float32)
    return found


def _correction(steps: list[Plane], hole: NDArray[np.bool_], screen: float) -> Plane:
    # The least squares solution c, 0 outside the hole: differences of c match `steps`, and c is small.
    found = np.zeros(hole.shape, np.float32)
    if screen * _SOLVED**2 < 1:
        coarse = _correction(_halved_steps(steps, hole.shape), _halved_hole(hole), 4 * screen)
        found = (coarse.repeat(2, axis=0).repeat(2, axis=1)[: hole.shape[0], : hole.shape[1]] * hole).astype(
            np.float32
        )
    inside = hole.astype(np.float32)
    count = np.zeros(hole.shape, np.float32)
    rest = np.zeros(hole.shape, np.float32)
    for axis in (0, 1):
        first, second = _ends(axis)
        rest[first] -= steps[axis]
        rest[second] += steps[axis]
        count[first] += 1
        count[second] += 1
    count = (count + np.float32(screen)) * inside

    def applied(c: Plane) -> Plane:
        out = count * c
        for axis in (0, 1):
            first, second = _ends(axis)
            out[first] -= c[second]
            out[second] -= c[first]
        out *= inside
        return out

    rest = rest * inside - applied(found)
    # Y. Saad: Iterative methods for sparse linear systems, 2003, algorithm 12.1, for eigenvalues up to 8.
    least = max(screen, 1 / _SOLVED**2)
    middle, half = np.float32(least / 2 + 4), np.float32(4 - least / 2)
    rho = half / middle
    step = rest / middle
    found += step
    for _ in range(_ROUNDS):
        rest -= applied(step)
        after = 1 / (2 * middle / half - rho)
        step = after * rho * step + (2 * after / half) * rest
        found += step
        rho = after
    return found


def _halved_hole(hole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    # For each 2 x 2 pixels: whether any of them is in the hole.
    whole = np.pad(hole, [(0, side % 2) for side in hole.shape])
    found: NDArray[np.bool_] = whole[::2] | whole[1::2]
    return found[:, ::2] | found[:, 1::2]


def _halved_steps(steps: list[Plane], shape: tuple[int, ...]) -> list[Plane]:
    # The same on a plane of half the size: the step from the middle of two pixels to the middle of the next
    # two, averaged over two parallel paths.
    found = []
    for axis in (0, 1):
        along = steps[axis].T if axis else steps[axis]
        length, width = (shape[1], shape[0]) if axis else (shape[0], shape[1])
        along = np.pad(along, ((0, length % 2 + 1), (0, width % 2)))
        within, between = along[::2], along[1::2]
        ways = between[:-1] + np.float32(0.5) * (within[:-1] + within[1:])
        half = np.float32(0.5) * (ways[:, ::2] + ways[:, 1::2])
        found.append(np.ascontiguousarray(half.T if axis else half))
    return found


def _ends(axis: int) -> tuple[Any, Any]:
    # The first pixel of each pair of neighbours along an axis, and the second.
    if axis == 0:
        return (slice(None, -1), slice(None)), (slice(1, None), slice(None))
    return (slice(None), slice(None, -1)), (slice(None), slice(1, None))
