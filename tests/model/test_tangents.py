"""Tangents of meshes: where u grows, across the normal, of length 1, also at poles."""

from typing import Any

import numpy as np
import pytest

from upholster.charts.layout import density_layout
from upholster.charts.tessellation.mesh import face_parameters, tessellate
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.revolution import cone, vase
from upholster.geometry.built_in.sphere import sphere
from upholster.model.tangents import vertex_tangents


@pytest.mark.parametrize(
    "surface", [ring_cyclide(), sphere(), sphere(tiling="octants"), vase(), cone()], ids=lambda s: s.name
)
def test_they_point_where_t_grows(surface: Any) -> None:
    charts = density_layout(surface, texels=50_000)
    mesh = tessellate(surface, charts, quads=2000)
    tangents = vertex_tangents(surface, charts, mesh)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ij,ij->i", tangents, mesh.normals), 0, atol=1e-9)
    for n, chart in enumerate(charts):
        mine, face = mesh.chart == n, surface.faces[chart.face]
        rows, columns = mesh.places[mine].T
        rows = np.clip(rows, 0.01 * chart.height, 0.99 * chart.height)
        ends = [np.clip(columns + step * chart.width, 0, chart.width) for step in (-1e-5, 1e-5)]
        before, behind = (face.points(*face_parameters(chart, rows, end)) for end in ends)
        step = (behind - before) / np.linalg.norm(behind - before, axis=1, keepdims=True)
        assert (np.einsum("ij,ij->i", step, tangents[mine]) > 0.97).all()
