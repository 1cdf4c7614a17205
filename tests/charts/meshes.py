"""Triangle meshes for tests of direction fields, made by formulas."""

import numpy as np

from upholster.charts.charted_surface import ChartedSurface, charted_mesh
from upholster.charts.mesh_layout import mesh_charts
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh, welded


def grid(rows: int, columns: int, *, wrap: tuple[bool, bool] = (False, False)) -> np.ndarray:
    """Return the triangles of a grid of (rows + 1)·(columns + 1) vertices, fewer where it closes."""
    high, wide = rows + (not wrap[0]), columns + (not wrap[1])
    i, j = (x.ravel() for x in np.mgrid[:rows, :columns])
    at = [(i + a) % high * wide + (j + b) % wide for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return np.concatenate([np.stack(at[:3], axis=1), np.stack([at[0], at[2], at[3]], axis=1)])


def sphere(count: int = 24) -> TriangleMesh:
    """Return a sphere of radius 1, a cube's grids blown up, z up."""
    line = np.linspace(-1, 1, count + 1)
    u, v = (x.ravel() for x in np.meshgrid(line, line))
    sides, triangles = [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            side = np.empty((len(u), 3))
            side[:, axis], side[:, (axis + 1) % 3], side[:, (axis + 2) % 3] = (
                sign,
                np.tan(np.pi / 4 * u),
                np.tan(np.pi / 4 * v * sign),
            )
            triangles.append(grid(count, count)[:, ::-1] + len(u) * len(sides))
            sides.append(side / np.linalg.norm(side, axis=1, keepdims=True))
    positions, vertex = welded(np.round(np.concatenate(sides), 12))
    return TriangleMesh(positions, vertex[np.concatenate(triangles)])


def torus(rows: int = 24, columns: int = 60, radius: float = 2.0) -> TriangleMesh:
    """Return a torus round z, its tube of radius 1."""
    a, b = (x.ravel() for x in np.mgrid[:columns, :rows])
    a, b = 2 * np.pi * a / columns, 2 * np.pi * b / rows
    wide = radius + np.cos(b)
    positions = np.stack([wide * np.cos(a), wide * np.sin(a), np.sin(b)], axis=1)
    return TriangleMesh(positions, grid(columns, rows, wrap=(True, True)))


def height_field(count: int, height: float = 0.0, size: float = 1.0) -> TriangleMesh:
    """Return a square sheet with waves of some height, seen from above."""
    y, x = (s.ravel() for s in np.mgrid[: count + 1, : count + 1] * (size / count))
    z = height * np.sin(5 * x) * np.cos(4 * y)
    return TriangleMesh(np.stack([x, y, z], axis=1), grid(count, count)[:, ::-1])


def box(sizes: tuple[float, float, float] = (3.0, 2.0, 1.0), count: int = 4) -> TriangleMesh:
    """Return a box with sharp edges, count² squares to a side."""
    line = np.linspace(0, 1, count + 1)
    u, v = (x.ravel() for x in np.meshgrid(line, line))
    sides, triangles = [], []
    for axis in range(3):
        for high in (1, 0):
            side = np.empty((len(u), 3))
            side[:, axis], side[:, (axis + 1) % 3] = high, u
            side[:, (axis + 2) % 3] = v if high else 1 - v
            triangles.append(grid(count, count)[:, ::-1] + len(u) * len(sides))
            sides.append(side)
    positions, vertex = welded(np.round(np.concatenate(sides), 12) * sizes)
    return TriangleMesh(positions, vertex[np.concatenate(triangles)])


def two_rings() -> TriangleMesh:
    """Return a closed mesh of genus 2: a slab with two square holes, its edges sharp."""
    solid = np.ones((7, 5), bool)
    solid[2, 2] = solid[4, 2] = False
    points: dict[tuple[int, int, int], int] = {}
    triangles = []

    def side(corners: list[tuple[int, int, int]]) -> None:
        a, b, c, d = (points.setdefault(corner, len(points)) for corner in corners)
        triangles.extend([(a, b, c), (a, c, d)])

    for x, y in np.argwhere(solid).tolist():
        side([(x, y, 1), (x + 1, y, 1), (x + 1, y + 1, 1), (x, y + 1, 1)])
        side([(x, y, 0), (x, y + 1, 0), (x + 1, y + 1, 0), (x + 1, y, 0)])
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            inside = 0 <= x + dx < solid.shape[0] and 0 <= y + dy < solid.shape[1]
            if inside and solid[x + dx, y + dy]:
                continue
            middle = np.array([x, y]) + 0.5 + 0.5 * np.array([dx, dy])
            first = (middle + 0.5 * np.array([dy, -dx])).astype(int).tolist()
            last = (middle - 0.5 * np.array([dy, -dx])).astype(int).tolist()
            side([(*first, 0), (*last, 0), (*last, 1), (*first, 1)])
    return TriangleMesh(np.array(list(points), float), np.array(triangles))


def on_charts(surface: MeshSurface, density: float = 1.0) -> ChartedSurface:
    """Return a mesh's islands with charts of so many steps a unit of length."""
    return charted_mesh(surface, mesh_charts(surface, density))
