"""A map of strokes with values, from a file."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.lengths import Length, read_length
from upholster.charts.directions.strokes import MOST_STROKES, read_stroke_list, stroke_triangles
from upholster.charts.maps._map_kernels import nearest_strokes
from upholster.charts.maps.map_ground import AtSteps, MapGround, Steps
from upholster.charts.maps.map_source import MapSource
from upholster.charts.maps.shapes import corners_of, length_on

__all__ = ["Painted"]

_RADIUS = 0.05
"""Default radius of a stroke, as a share of the model's size."""

_FARTHEST = 1e18
"""Largest coordinate, as for a mesh."""

_ALLOWED = '{"at": [x, y, z], "value": 0 to 1}, and optionally "radius": a length above 0'


class _Stroke(NamedTuple):
    at: tuple[float, float, float]
    value: float
    radius: Length | None


@dataclass(frozen=True)
class Painted(MapSource):
    """Values of strokes, a list of ``{"at": [x, y, z], "value": 0.7, "radius": "3cm"}`` in a JSON file.

    Among the strokes whose radius reaches a step the nearest counts; among equally near ones, the last. A
    stroke does not reach faces whose normal differs by more than 120° from the normal at its place, like the
    other side of a wall. Elsewhere the map has no value.
    """

    file: str

    @property
    def files(self) -> tuple[str, ...]:
        """The files that it reads."""
        return (self.file,)

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        strokes = _read(self.file)
        mesh = ground.charted.mesh
        places = np.array([stroke.at for stroke in strokes])
        facing = mesh.flat_normals[stroke_triangles(mesh, places)]
        levels = np.array([stroke.value for stroke in strokes])
        radii = np.array(
            [
                _RADIUS * mesh.size if stroke.radius is None else length_on(ground, stroke.radius, "radius")
                for stroke in strokes
            ]
        )
        corners, normals = corners_of(mesh), mesh.flat_normals

        def at(steps: Steps) -> NDArray[np.float32]:
            out = np.empty(len(steps.triangles), np.float32)
            listed = np.empty(len(strokes), np.int32)
            points, upright = steps.mean_of(corners), normals[steps.triangles]
            nearest_strokes(points, upright, places, facing, radii, levels, listed, out)
            return out

        return at


def _read(file: str) -> list[_Stroke]:
    """Return a file's strokes.

    Raises
    ------
    InputError
        If it cannot be read, or an entry is not a stroke.
    """
    listed = read_stroke_list(file)
    if not 1 <= len(listed) <= MOST_STROKES:
        raise InputError(f"strokes {file}: there are {len(listed)}; allowed: 1 to {MOST_STROKES}")
    return [_stroke(one, f"strokes {file}: stroke {number}") for number, one in enumerate(listed)]


def _stroke(one: object, name: str) -> _Stroke:
    if not isinstance(one, dict) or not {"at", "value"} <= one.keys() <= {"at", "value", "radius"}:
        raise InputError(f"{name} is {str(one)[:60]}; allowed: {_ALLOWED}")
    at, value, radius = one["at"], one["value"], one.get("radius")
    if not isinstance(at, list) or len(at) != 3 or not all(_is_within(x, -_FARTHEST, _FARTHEST) for x in at):
        raise InputError(f"{name} is at {str(at)[:60]}; allowed: three finite numbers")
    if not _is_within(value, 0.0, 1.0):
        raise InputError(f"{name} has the value {str(value)[:60]}; allowed: 0 to 1")
    length = None if radius is None else read_length(radius, name=f"{name}: radius")
    if length is not None and not length.number > 0:
        raise InputError(f"{name} has the radius {str(radius)[:60]}; allowed: a length above 0")
    x, y, z = map(float, at)
    return _Stroke((x, y, z), float(value), length)


def _is_within(value: object, least: float, most: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and least <= value <= most
