"""Patches as triangles that hang together, also at poles; patch lists with poles are covered as such."""

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.surface_to_cover import as_covered
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.meshes.patch_mesh import patch_mesh
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.synthesis.surface_request import needs_patches


def cone(folder):
    """A patch list of two bi-linear patches with a common tip."""
    file = folder / "cone.bpt"
    rows = ["0 0 2 0 0 2", "1 1 0 -1 1 0", "0 0 2 0 0 2", "-1 1 0 -1 -1 0"]
    points = [row.split() for row in rows]
    lines = ["2"]
    for k in range(2):
        lines.append("1 1")
        for row in points[2 * k : 2 * k + 2]:
            lines += [" ".join(row[:3]), " ".join(row[3:])]
    file.write_text("\n".join(lines) + "\n")
    return file


def test_a_closed_surface_with_poles_is_a_closed_mesh():
    sphere = surface_from_spec("sphere", biquadratic=True)
    assert sphere.degenerate
    mesh = patch_mesh(sphere)
    assert (mesh.neighbours >= 0).all()
    vertices, edges, faces = len(mesh.positions), len(mesh.triangles) * 3 // 2, len(mesh.triangles)
    assert vertices - edges + faces == 2
    np.testing.assert_allclose(np.linalg.norm(mesh.positions, axis=1), 1.0)
    np.testing.assert_allclose(mesh.normals, mesh.corners, atol=1e-6)
    assert ((mesh.flat_normals[:, None] * mesh.normals).sum(axis=2) > 0.9).all()


def test_edges_that_meet_over_parts_are_refused():
    def flat(x0, x1, y0, y1):
        return RationalPatch.from_points([[(x0, y0, 0), (x1, y0, 0)], [(x0, y1, 0), (x1, y1, 0)]])

    with pytest.raises(InputError, match="over parts"):
        patch_mesh(Surface([flat(0, 2, 0, 1), flat(0, 1, 1, 2), flat(1, 2, 1, 2)], "T"))


def test_patch_lists_with_poles_are_covered_as_meshes(tmp_path):
    file = cone(tmp_path)
    covered = as_covered(file)
    assert isinstance(covered.surface, MeshSurface)
    assert "its patches have poles: covered as a mesh of" in covered.notes[0]
    assert isinstance(as_covered(file, patches=True).surface, Surface)
    assert isinstance(as_covered(surface_from_spec(file)).surface, Surface)


@pytest.mark.parametrize(
    ("options", "needed"),
    [
        ({}, False),
        ({"direction": "level"}, False),
        ({"direction": "u"}, True),
        ({"rotate": True}, False),
        ({"texels": (64, 64)}, True),
        ({"method": "paper"}, True),
    ],
)
def test_what_needs_patches(options, needed):
    assert needs_patches(SynthesisOptions(**options)) == needed
