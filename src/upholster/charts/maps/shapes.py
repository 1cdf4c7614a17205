"""Maps of a surface's shape: its parts, its points' positions, and its normals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.lengths import Length
from upholster.base.types import FloatArray
from upholster.base.vectors import unit_vectors
from upholster.charts.maps.map_ground import AtSteps, MapGround, Steps
from upholster.charts.maps.map_source import MapSource
from upholster.geometry.meshes.corner_normals import corner_normals
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["Ball", "Facing", "Height", "Part", "Slope", "corners_of", "length_on"]


@dataclass(frozen=True)
class Part(MapSource):
    """1 on the parts that a pattern fits, see `ModelFile.fitting`, and 0 elsewhere."""

    pattern: str
    is_binary = True

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        if ground.model is None:
            raise InputError(
                f"map 'part:{self.pattern}' is for models, and this surface has no parts; allowed: other maps"
            )
        chosen = np.zeros(len(ground.model.parts), np.float32)
        chosen[ground.model.fitting([self.pattern])] = 1
        of_triangle = chosen[ground.charted.mesh.part]
        return lambda steps: of_triangle[steps.triangles]


@dataclass(frozen=True)
class Height(MapSource):
    """0 at the lowest point, 1 at the highest; 0 if the surface is level everywhere."""

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        mesh = ground.charted.mesh
        low, high = mesh.box[:, 2]
        up = np.ascontiguousarray(corners_of(mesh)[..., 2:]) - low
        up /= high - low if high > low else 1.0
        return lambda steps: np.clip(steps.mean_of(up)[:, 0], 0.0, 1.0)


@dataclass(frozen=True)
class Slope(MapSource):
    """0 where the surface is level, 1 where it is upright: the sine of the angle between its normal and z."""

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        normals = np.array(corner_normals(ground.charted.mesh))
        return lambda steps: np.linalg.norm(_mean(normals, steps)[:, :2], axis=1)


@dataclass(frozen=True)
class Facing(MapSource):
    """1 where the normal points along a direction, 0 where it points against it, ½ across."""

    direction: tuple[float, float, float]

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        normals = np.array(corner_normals(ground.charted.mesh))
        wanted = np.array(self.direction) / np.abs(self.direction).max()
        wanted /= np.linalg.norm(wanted)
        return lambda steps: np.clip((1 + (_mean(normals, steps) * wanted).sum(axis=1)) / 2, 0.0, 1.0)


@dataclass(frozen=True)
class Ball(MapSource):
    """1 within a ball, 0 outside."""

    middle: tuple[float, float, float]
    radius: Length
    is_binary = True

    def values(self, ground: MapGround, /) -> AtSteps:
        """Return a function for values."""
        mesh = ground.charted.mesh
        radius = length_on(ground, self.radius, "radius")
        from_middle = corners_of(mesh) - np.array(self.middle)

        def at(steps: Steps) -> NDArray[np.bool_]:
            return np.asarray(np.linalg.norm(steps.mean_of(from_middle), axis=1) <= radius)

        return at


def corners_of(mesh: TriangleMesh) -> FloatArray:
    """Return positions of the triangles' corners, (T, 3, 3), in a new array."""
    found: FloatArray = mesh.positions[mesh.triangles]
    return found


def length_on(ground: MapGround, length: Length, name: str) -> float:
    """Return a length in the units of the ground.

    Raises
    ------
    InputError
        If it has a unit, and the model's unit is not known.
    """
    return length.in_units(ground.charted.mesh.metres, name=f"{name} of a map")


def _mean(normals: FloatArray, steps: Steps) -> FloatArray:
    # Where opposite normals cancel halfway, the length stays 0.
    return unit_vectors(steps.mean_of(normals), least=1e-12)
