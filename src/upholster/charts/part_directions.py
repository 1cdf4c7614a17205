"""A direction for each part of a model: ``{"Shaft": "along", "*": "around"}``."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.options.direction_words import AXIS_DIRECTIONS
from upholster.base.types import FloatArray
from upholster.base.vectors import unit_vectors
from upholster.charts.axis_directions import axis_direction
from upholster.charts.directions.direction import TriangleVectors, Vectors, parse_direction
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.model_files.model_file import ModelFile

__all__ = ["is_by_part", "part_direction", "triangles_by_direction"]

_ALLOWED = "along, around, level, smooth, x, y, z, a vector x,y,z, or around:AXIS"

_SLOPE = 0.1
"""Sine of the slope from which a triangle has a level direction; flatter triangles are filled smoothly."""


def is_by_part(direction: object) -> bool:
    """Whether `part_direction` reads this direction."""
    return isinstance(direction, Mapping) or direction in AXIS_DIRECTIONS


def triangles_by_direction(model: ModelFile, wanted: str | Mapping[str, str]) -> dict[str, NDArray[np.bool_]]:
    """Return which triangles each direction is for, (T,) each.

    Parameters
    ----------
    model
        The model to cover.
    wanted
        Directions by patterns as for `ModelFile.fitting`; the first pattern that fits a part counts. Or one
        direction for all. Triangles that no pattern fits are in none of the results.

    Raises
    ------
    InputError
        If a pattern fits no part.
    """
    by_pattern = {"*": wanted} if isinstance(wanted, str) else wanted
    owner = np.full(len(model.parts), -1)
    for number, pattern in reversed(list(enumerate(by_pattern))):
        owner[range(len(owner)) if pattern == "*" else model.fitting([pattern])] = number
    numbers = owner[model.mesh.part]
    out: dict[str, NDArray[np.bool_]] = {}
    for number, direction in enumerate(by_pattern.values()):
        out[direction] = out.get(direction, np.zeros(len(numbers), bool)) | (numbers == number)
    return out


def part_direction(model: ModelFile, wanted: str | Mapping[str, str]) -> Vectors:
    """Return the wanted direction on each triangle of a model; none on parts that no pattern fits.

    Parameters
    ----------
    model, wanted
        As for `triangles_by_direction`. Directions are ``along`` and ``around`` (see `axis_direction`),
        ``level``, ``smooth`` (no direction wanted) and vectors and axes as for `parse_direction`.

    Returns
    -------
    Callable
        Maps points to vectors, (T, 3) each; only for the centroids of the triangles of the model's mesh.

    Raises
    ------
    InputError
        If a pattern fits no part, a direction is none of these, or the file has no axes.
    """
    centres = model.mesh.corners.mean(axis=1)
    vectors = np.zeros((len(centres), 3))
    for direction, mine in triangles_by_direction(model, wanted).items():
        vectors[mine] = _vectors(model, direction, centres)[mine]
    named = {"": wanted} if isinstance(wanted, str) else wanted
    name = ", ".join(f"{name}={value}" if name else value for name, value in named.items())
    return TriangleVectors(centres, vectors, name)


def _vectors(model: ModelFile, direction: str, centres: FloatArray) -> FloatArray:
    """Return one direction at all triangles, of length 1 or 0."""
    if direction in AXIS_DIRECTIONS:
        return axis_direction(model, direction)
    found = parse_direction(direction)
    if found.kind == "smooth":
        return np.zeros_like(centres)
    if found.kind == "level" and not found.angle:
        return _level(model.mesh)
    if found.kind != "vectors" or not callable(found.vectors):
        raise InputError(f"direction {direction!r} is for a part; allowed there: {_ALLOWED}")
    return unit_vectors(np.asarray(found.vectors(centres), np.float64))


def _level(mesh: TriangleMesh) -> FloatArray:
    return unit_vectors(np.cross((0.0, 0.0, 1.0), mesh.flat_normals), least=_SLOPE, instead=0.0)
