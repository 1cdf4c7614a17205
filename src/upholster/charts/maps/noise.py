"""A map of smooth noise in space: the same on every machine, and on both sides of every seam.

References
----------
K. Perlin: Improving noise, SIGGRAPH 2002.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.lengths import Length
from upholster.base.types import FloatArray
from upholster.charts.maps._noise_kernels import add_noise
from upholster.charts.maps.map_ground import AtSteps, MapGround, Steps
from upholster.charts.maps.map_source import MapSource
from upholster.charts.maps.shapes import corners_of, length_on

__all__ = ["Noise"]

_BLOB = 1 / 8
_MOST_BLOBS = 1_000_000

_TURN = np.array([(2, -1, 2), (2, 2, -1), (-1, 2, 2)]) @ np.array([(3, -4, 0), (4, 3, 0), (0, 0, 5)]) / 15
"""Orientation of the lattice in space: along no axis, so that it does not show on level or upright faces."""

_Period = tuple[int, int, int]

_OCTAVES = ((1, 1.0), (2, 0.5))
"""Sizes of lattices, as shares of the blobs' size, and their weights."""

_SPREAD = 2.5 * 0.3
"""The sum that maps to 0 and 1: ± two and a half standard deviations of the sum of octaves."""


@dataclass(frozen=True)
class Noise(MapSource):
    """Smooth blobs of light and dark, about evenly distributed over 0 to 1; a tile's continue over its edges.

    Two octaves of gradient noise on a lattice that begins at the lowest corner of the model's box. A sum n
    becomes 3t² − 2t³ with t = ½ + n / 2s, cut to 0 … 1; s is 2½ standard deviations.

    Attributes
    ----------
    blob
        Approximate size of blobs; None: an eighth of the model's size.
    """

    blob: Length | None = None

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        mesh = ground.charted.mesh
        size = mesh.size or 1.0
        blob = _BLOB * size if self.blob is None else length_on(ground, self.blob, "blobs")
        if blob * _MOST_BLOBS < size:
            raise InputError(
                f"blobs of a map are {blob:g} model units; allowed: at least {size / _MOST_BLOBS:g}"
            )
        laid_on = _on_tile if ground.charted.is_tile else _in_space
        corners, (d, s, e) = laid_on(corners_of(mesh) - mesh.box[0], blob)

        def at(steps: Steps) -> NDArray[np.float32]:
            points, total = steps.mean_of(corners), np.zeros(len(steps.triangles))
            for finer, weight in _OCTAVES:
                add_noise(points * finer, (d * finer, s * finer, e * finer), weight, total)
            t = np.clip(0.5 + total / (2 * _SPREAD), 0.0, 1.0)
            return (t * t * (3 - 2 * t)).astype(np.float32)

        return at


def _in_space(corners: FloatArray, blob: float) -> tuple[FloatArray, _Period]:
    """Return the corners' places on the lattice, with no negative coordinate; and no period."""
    x, y, z = np.moveaxis(corners / blob, 2, 0)[..., None]  # the same order of sums on any machine
    turned = x * _TURN[:, 0] + y * _TURN[:, 1] + z * _TURN[:, 2]
    return turned - np.floor(turned.min(axis=(0, 1))), (0, 0, 0)


def _on_tile(corners: FloatArray, blob: float) -> tuple[FloatArray, _Period]:
    """Return the places of a tile's corners on a lattice, and the period with which it continues over edges.

    The lattice is rotated. From each edge to the opposite one it has an integer number of cells, so that both
    edges get the same values.
    """
    width, height, _ = corners.max(axis=(0, 1))
    cells = [(max(1, round(0.9 * side / blob)), round(0.44 * side / blob)) for side in (width, height)]
    right, up = (cells[0][0], -cells[0][1]), (cells[1][1], cells[1][0])
    x, y = corners[..., :1] / width, corners[..., 1:2] / height
    laid = np.concatenate([x * right + y * up, np.full_like(x, 0.37)], axis=2)  # between the lattice's layers
    return laid, _period(right, up)


def _period(first: tuple[int, int], second: tuple[int, int]) -> _Period:
    """Return (d, s, e) such that (d, 0) and (s, e) generate the same lattice as two vectors."""
    (a, b), (c, e) = first, second
    while b:  # Euclid's algorithm
        times = e // b
        a, b, c, e = c - times * a, e - times * b, a, b
    return abs(a), c if e > 0 else -c, abs(e)
