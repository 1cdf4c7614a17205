"""Tangents of meshes: where u grows, across the normal, of length 1, also at poles."""

from typing import Any

import numpy as np
import pytest

from upholster.geometry import cone, ring_cyclide, sphere, tessellate, vase
from upholster.geometry.tangents import vertex_tangents


@pytest.mark.parametrize(
    "surface", [ring_cyclide(), sphere(), sphere(tiling="octants"), vase(), cone()], ids=lambda s: s.name
)
def test_they_point_where_t_grows(surface: Any) -> None:
    mesh = tessellate(surface, quads=2000)
    tangents = vertex_tangents(surface, mesh)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ij,ij->i", tangents, mesh.normals), 0, atol=1e-9)
    for k, patch in enumerate(surface.patches):
        mine = mesh.patch == k
        s, t = mesh.parameters[mine].T
        inside = np.clip(s, 0.01, 0.99)
        step = patch.points(inside, np.minimum(t + 1e-5, 1)) - patch.points(inside, np.maximum(t - 1e-5, 0))
        step /= np.linalg.norm(step, axis=1, keepdims=True)
        assert (np.einsum("ij,ij->i", step, tangents[mine]) > 0.97).all()
