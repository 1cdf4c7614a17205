"""Meshes laid out flat: islands cover the mesh, turn as in space, and keep areas."""

import numpy as np
import pytest

from upholster.charts.unwrap import unwrap
from upholster.geometry.triangle_mesh import MeshSurface, TriangleMesh

pytest.importorskip("xatlas")


def torus(rows: int = 24, columns: int = 36) -> TriangleMesh:
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    positions = np.stack([(3 + np.cos(a)) * np.cos(b), (3 + np.cos(a)) * np.sin(b), np.sin(a)], axis=-1)
    here, right = i * columns + j, i * columns + (j + 1) % columns
    down, both = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
    triangles = np.stack([here, right, both, here, both, down], axis=-1).reshape(-1, 3)
    return TriangleMesh(positions.reshape(-1, 3), triangles)


def turned(surface: MeshSurface) -> np.ndarray:
    a = surface.parameters[:, 1] - surface.parameters[:, 0]
    b = surface.parameters[:, 2] - surface.parameters[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def test_torus_is_covered_without_flips():
    mesh = torus()
    surface, report = unwrap(mesh)
    assert report.plain == 0
    assert (surface.island >= 0).all()
    assert (turned(surface) > 0).all()
    for island in range(surface.islands):
        own = surface.island == island
        assert turned(surface)[own].sum() == pytest.approx(mesh.areas[own].sum())
