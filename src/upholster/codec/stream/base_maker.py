"""Making a stream's base: any surface as few triangles, with the exemplar's mean direction and scale."""

import numpy as np

from upholster.base.types import FloatArray, IntArray
from upholster.codec.stream.base_chunk import SIDES, CoarseMesh, mean_angle, pack_base, side_places, sides_of
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.simplification import simplified
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.quilt.model import Quilt

__all__ = ["made_base"]

_MOST_QUADS = 50_000
"""Approximate largest number of quads into which patches are divided; at most `_MOST_PARTS`² per patch."""

_MOST_PARTS = 8

_LEAST, _GREATEST, _PIXELS = 1e-30, 1e30, 1e8
"""Lengths in model units that a base can store, and the most pixels of the exemplar along a model."""


def made_base(surface: AnySurface, quilt: Quilt, most_bytes: int, bits: int) -> bytes:
    """Return the payload of a base, of at most `most_bytes` bytes; empty if none is possible.

    Parameters
    ----------
    surface, quilt
        The surface and the quilt on it.
    most_bytes
        The largest length.
    bits
        Bits of a coordinate.
    """
    corners, faces, parameters = _triangles_of(surface)
    low, most = corners.min(axis=(0, 1)), (1 << bits) - 1
    size = float((corners.max(axis=(0, 1)) - low).max()) or 1.0
    origin = (float(low[0]), float(low[1]), float(low[2]))
    pixel, angles = _measured(corners, faces, parameters, quilt)
    metres = (surface.mesh.metres or 0.0) if isinstance(surface, MeshSurface) else 0.0
    if not (min(size, pixel) > _LEAST and max(size, pixel, metres) < _GREATEST and size < _PIXELS * pixel):
        return b""

    def coded(positions: IntArray, triangles: IntArray) -> bytes:
        return pack_base(CoarseMesh(positions, triangles, bits, origin, size / most, pixel, metres, angles))

    found = simplified((corners - low) / size, bits, lambda *some: len(coded(*some)) <= most_bytes)
    return b"" if found is None else coded(*found)


def _triangles_of(surface: AnySurface) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return corners (T, 3, 3), faces (T,), −1 for plain triangles, and (s, t) of corners (T, 3, 2)."""
    if isinstance(surface, MeshSurface):
        return surface.mesh.corners, surface.island, surface.parameters
    parts = int(np.clip(np.sqrt(_MOST_QUADS / len(surface.patches)), 1, _MOST_PARTS))
    corners, faces, parameters = [], [], []
    for number, face in enumerate(surface.faces):
        s = np.linspace(0, face.rows, face.rows * parts + 1)
        t = np.linspace(0, face.columns, face.columns * parts + 1)
        points, places = face.points_grid(s, t), np.stack(np.meshgrid(s, t, indexing="ij"), axis=-1)
        corners.append(_halved(points))
        parameters.append(_halved(places))
        faces.append(np.full(len(corners[-1]), number, np.int32))
    return np.concatenate(corners), np.concatenate(faces), np.concatenate(parameters)


def _halved(grid: FloatArray) -> FloatArray:
    """Return the corners (T, 3, …) of two triangles for each quad of a grid (m, n, …)."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    return halves.reshape(-1, 3, grid.shape[2])


def _measured(
    corners: FloatArray, faces: IntArray, parameters: FloatArray, quilt: Quilt
) -> tuple[float, tuple[int, ...]]:
    """Return model units per pixel of the exemplar, and its mean angle on each side of the box."""
    sides = sides_of(corners)
    edges = _edges(side_places(corners, sides))
    areas = np.abs(np.linalg.det(edges))
    maps = _maps_of(faces, parameters, quilt) @ _edges(parameters)
    used = (areas > 1e-9 * areas.max()) & np.isfinite(maps).all(axis=(1, 2))
    maps, weights = maps[used] @ np.linalg.inv(edges[used]), areas[used]
    real = 0.5 * np.linalg.norm(np.cross(*np.moveaxis(np.diff(corners[used], axis=1), 1, 0)), axis=1)
    pixels = np.abs(np.linalg.det(maps)) * weights / 2  # of the exemplar, on each triangle
    pixel = float(np.sqrt(real.sum() / pixels.sum())) if pixels.sum() > 0 else 1.0
    angles = [mean_angle(maps[sides[used] == side], weights[sides[used] == side]) for side in range(SIDES)]
    return pixel, tuple(angles)


def _edges(places: FloatArray) -> FloatArray:
    """Return the two edges from the first corners of triangles (T, 3, 2), as columns: (T, 2, 2)."""
    return np.swapaxes(places[:, 1:] - places[:, :1], 1, 2)


def _maps_of(faces: IntArray, parameters: FloatArray, quilt: Quilt) -> FloatArray:
    """Return the maps from parameters to pixels of the exemplar at triangles, (T, 2, 2); NaN without one."""
    maps = np.full((len(faces), 2, 2), np.nan)
    middles = parameters.mean(axis=1)
    order = np.argsort(faces, kind="stable")
    starts = np.searchsorted(faces[order], np.arange(int(faces.max()) + 2))
    for chart, field in zip(quilt.charts, quilt.fields, strict=True):
        own = order[starts[chart.face] : starts[chart.face + 1]]
        s, t = middles[own].T
        within = (chart.s0 <= s) & (s <= chart.s1) & (chart.t0 <= t) & (t <= chart.t1)
        own, s, t = own[within], s[within], t[within]
        scale = np.array([chart.height / (chart.s1 - chart.s0), chart.width / (chart.t1 - chart.t0)])
        maps[own] = field.at((s - chart.s0) * scale[0] - 0.5, (t - chart.t0) * scale[1] - 0.5) * scale
    return maps
