"""Phases over meshes: they go on over edges and close, and follow directions that jump."""

import numpy as np
from tests.charts.meshes import on_charts, torus

from upholster.charts.phases import TURN, mesh_phases
from upholster.charts.warp_fields import triangle_frames
from upholster.geometry import MeshSurface

SCALE = 20.0


def rings(mesh):
    """Return a torus by quarters round z, each laid out flat, and level vectors at triangles' corners."""
    middle = mesh.corners.mean(axis=1)
    island = np.floor(np.arctan2(middle[:, 1], middle[:, 0]) / (np.pi / 2)).astype(int) % 4
    around = np.arctan2(mesh.corners[..., 1], mesh.corners[..., 0]) - island[:, None] * np.pi / 2
    around = (around + np.pi / 4) % (2 * np.pi) - np.pi / 4
    wide = np.hypot(mesh.corners[..., 0], mesh.corners[..., 1])
    tube = np.arctan2(mesh.corners[..., 2], wide - 2)
    # A triangle over the cut of the tube lies on one side of it.
    tube = np.where((np.ptp(tube, axis=1) > np.pi)[:, None] & (tube < 0), tube + 2 * np.pi, tube)
    surface = MeshSurface(mesh, island, np.stack([-tube, 2 * around], axis=2))
    along = np.cross([0, 0, 1.0], mesh.corners)
    return on_charts(surface), along / np.linalg.norm(along, axis=2, keepdims=True)


def over_edges(surface, field, sign=None):
    """Return by how many turns phases of both sides of each edge differ at its middle, (n, edges)."""
    mesh = surface.mesh
    triangle, edge = np.nonzero(mesh.neighbours >= 0)
    other = (mesh.neighbours[triangle, edge] // 3).astype(np.int32)
    middle = 0.5 * (mesh.corners[triangle, edge] + mesh.corners[triangle, (edge + 1) % 3])
    here, there = (
        field.at(t.astype(np.int32), middle).astype(float) * (1 if sign is None else sign[t])
        for t in (triangle, other)
    )
    apart = (here - there) / TURN
    return np.abs(apart - np.rint(apart))


def test_rows_round_a_torus_close():
    surface, vectors = rings(torus(48, 120))
    field = mesh_phases(surface, vectors, SCALE, np.array([(1 / 14.7, 0)]), 0.3)
    assert len(field.centres) < len(surface.chart)
    apart = over_edges(surface, field)
    assert apart.max() < 0.1
    # The wave is as long as it shall be: from a triangle's corner to the next, along its own axes.
    along, down = triangle_frames(surface.mesh, vectors)
    corners = surface.mesh.corners
    triangles = np.arange(len(corners), dtype=np.int32)
    step = field.at(triangles, corners[:, 1]).astype(float) - field.at(triangles, corners[:, 0])
    wanted = SCALE / 14.7 * ((corners[:, 1] - corners[:, 0]) * down).sum(axis=1)
    away = step / TURN - wanted
    assert np.abs(away - np.rint(away)).max() < 0.1
    assert along.shape == down.shape


def test_where_directions_are_turned_round_a_wave_goes_on_as_its_opposite():
    surface, vectors = rings(torus(48, 120))
    sign = np.where(surface.mesh.corners.mean(axis=1)[:, 0] > 0, 1, -1)
    turned = mesh_phases(surface, vectors * sign[:, None, None], SCALE, np.array([(1 / 14.7, 0)]), 0.3)
    assert over_edges(surface, turned, sign).max() < 0.1
    assert over_edges(surface, turned).max() > 0.2
