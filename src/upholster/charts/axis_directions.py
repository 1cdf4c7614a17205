"""Directions along and around the axes of a CAD model's faces: cylinders, cones, tori, turned shapes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.base.vectors import unit_vectors
from upholster.geometry.model_files.model_file import ModelFile

__all__ = ["Round", "axis_direction", "closed_rounds"]

_ALIKE = 1e-4
"""Directions, and places divided by the model's size, count as equal if they differ by less."""


_UPRIGHT = 0.05
"""A cylinder's normals are perpendicular to its axis up to this sine of an angle."""

_SECTORS = 12
"""Sectors of a full turn: faces seen in all of them go all the way round."""


class Round(NamedTuple):
    """A closed cylinder: its circumference, in model units, and its area."""

    length: float
    area: float


def closed_rounds(model: ModelFile, chosen: NDArray[np.bool_] | None = None) -> list[Round]:
    """Return a CAD model's closed cylinders, largest first.

    Parameters
    ----------
    model
        The model.
    chosen
        (T,) whether to use each triangle; by default all.
    """
    if model.axes is None:
        return []
    mesh = model.mesh
    places, ways = model.axes[:, 0], _one_way(model.axes[:, 1])
    off = mesh.corners.mean(axis=1) - places
    radial = off - (off * ways).sum(axis=1, keepdims=True) * ways
    radius = np.linalg.norm(mesh.corners[:, 0] - places - _along(mesh.corners[:, 0] - places, ways), axis=1)
    slope = np.abs((mesh.flat_normals * ways).sum(axis=1))
    able = (ways != 0).any(axis=1) & (slope < _UPRIGHT) & (radius > 0)
    mine = np.flatnonzero(able if chosen is None else able & chosen)
    if not len(mine):
        return []
    feet = places - _along(places, ways)
    keys = np.concatenate([ways, feet / mesh.size, radius[:, None] / mesh.size], axis=1)[mine]
    _, group = np.unique(np.rint(keys / (10 * _ALIKE)).astype(np.int64), axis=0, return_inverse=True)
    group = group.reshape(-1)
    out = []
    for number in range(int(group.max()) + 1):
        own = mine[group == number]
        first = radial[own[0]]
        second = np.cross(ways[own[0]], first)
        angle = np.arctan2(radial[own] @ second, radial[own] @ first)
        sectors = np.unique(np.floor((angle / (2 * np.pi) + 0.5) * _SECTORS) % _SECTORS)
        if len(sectors) == _SECTORS:
            out.append(Round(2 * np.pi * float(radius[own].mean()), float(mesh.areas[own].sum())))
    return sorted(out, key=lambda one: -one.area)


def _along(vectors: FloatArray, ways: FloatArray) -> FloatArray:
    part: FloatArray = (vectors * ways).sum(axis=1, keepdims=True) * ways
    return part


def axis_direction(model: ModelFile, kind: str) -> FloatArray:
    """Return the directions for "along" or "around" on a CAD model.

    A face with an axis follows it. Any other face follows its part's axis: the one with the largest area in
    the part, or the part's longest direction if no face has an axis. Opposite axes count as one, so that
    adjacent faces agree.

    Parameters
    ----------
    model
        Read from a CAD file.
    kind
        One of `AXIS_DIRECTIONS`.

    Returns
    -------
    FloatArray
        (T, 3) vectors of length 1 for the triangles of the model's mesh; 0 on the axis itself.

    Raises
    ------
    InputError
        If the model is from another kind of file, which stores no axes.
    """
    if model.axes is None:
        raise InputError(f"direction is {kind!r}, and this model's file has no axes; allowed: with CAD files")
    mesh = model.mesh
    centres = mesh.corners.mean(axis=1)
    places, ways = model.axes[:, 0].copy(), _one_way(model.axes[:, 1])
    has = (ways != 0).any(axis=1)
    for part in np.unique(mesh.part):
        mine = mesh.part == part
        place, way = _main_axis(places[mine & has], ways[mine & has], mesh.areas[mine & has], mesh.size)
        if way is None:
            place, way = _longest(centres[mine], mesh.areas[mine])
        places[mine & ~has], ways[mine & ~has] = place, way
    vectors = ways if kind == "along" else np.cross(ways, centres - places)
    return unit_vectors(vectors, least=1e-12 * mesh.size)


def _one_way(ways: FloatArray) -> FloatArray:
    """Flip vectors so that their last component that is not about 0 is positive."""
    sign = np.ones(len(ways))
    for k in (0, 1, 2):
        sign = np.where(np.abs(ways[:, k]) > _ALIKE, np.sign(ways[:, k]), sign)
    return np.asarray(ways * sign[:, None], np.float64)


def _main_axis(
    places: FloatArray, ways: FloatArray, areas: FloatArray, size: float
) -> tuple[FloatArray, FloatArray | None]:
    """Return place and direction of the axis with the largest area; None without any."""
    if not len(ways):
        return np.zeros(3), None
    along = (places * ways).sum(axis=1, keepdims=True)
    feet = places - along * ways  # the same point for all places on one line
    keys = np.rint(np.concatenate([ways, feet / size], axis=1) / _ALIKE).astype(np.int64)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    best = first[int(np.bincount(group.reshape(-1), areas).argmax())]
    return places[best], ways[best]


def _longest(centres: FloatArray, areas: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centroid of some triangles, and the direction of their largest extent."""
    weights = areas / max(float(areas.sum()), 1e-300)
    middle = weights @ centres
    off = centres - middle
    _, vectors = np.linalg.eigh((off * weights[:, None]).T @ off)
    return middle, _one_way(vectors[:, -1:].T)[0]
