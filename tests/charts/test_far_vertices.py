"""Stray vertices and control points: named, and refused before they cost gigabytes."""

import json
from pathlib import Path

import numpy as np
import pytest
from meshes import box, grid, sphere

from upholster import Surface, cover, surface_from_spec
from upholster.apps.cli.model_info import show_model
from upholster.apps.cli.surface_info import show_surface
from upholster.base.errors import InputError
from upholster.charts.charted_surface import charted_mesh, charted_patches
from upholster.charts.far_vertices import far_vertices
from upholster.charts.layout import density_layout
from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.subdivision import subdivided
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.patches.patch import RationalPatch
from upholster.image.files.write import write_image

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def strip(far: float, width: float) -> TriangleMesh:
    """Return a square, and a triangle from it to two vertices far away."""
    return TriangleMesh(
        np.array([*SQUARE, (far, 0, 0), (far, width, 0)]), np.array([(0, 1, 2), (0, 2, 3), (1, 4, 5)])
    )


def thin_ring(width: float, count: int = 200) -> TriangleMesh:
    angle = 2 * np.pi * np.arange(count) / count
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return TriangleMesh(np.concatenate([around, (1 + width) * around]), grid(1, count, wrap=(False, True)))


def pulled(height: float) -> Surface:
    """Return a square patch of which one control point is pulled up."""
    points = np.stack(
        [*np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij"), np.zeros((4, 4))], axis=-1
    )
    points[1, 2, 2] = height
    return Surface([RationalPatch.from_points(points)])


def test_far_vertices_are_named_with_their_share_of_the_surface() -> None:
    far = far_vertices(strip(1e4, 2e-4))
    assert far is not None
    np.testing.assert_array_equal(far.places, [(1e4, 0, 0), (1e4, 2e-4, 0)])
    assert far.share == pytest.approx(0.5, rel=1e-3)
    assert far.words == (
        "2 vertices are far away from the 4 others, at (10000, 0, 0), (10000, 0.0002, 0), with 50 % of the "
        "surface"
    )
    net = far_vertices(pulled(1e5))
    assert net is not None
    assert net.words == (
        "1 control point is far away from the 15 others, at (1, 2, 100000), with 100 % of the surface"
    )


def test_models_without_strays_have_none() -> None:
    mesh = strip(1e4, 1.0)
    unused = TriangleMesh(mesh.positions, mesh.triangles[:2])
    stretched = TriangleMesh(np.array(SQUARE) * (1000, 1, 1), mesh.triangles[:2])
    for one in (
        box(),
        sphere(6),
        unused,
        stretched,
        strip(40.0, 1.0),
        surface_from_spec("vase"),
        pulled(9.0),
    ):
        assert far_vertices(one) is None


def test_pieces_are_counted_before_they_are_made() -> None:
    mesh = strip(1e5, 1e-6)
    surface, report = unwrap(mesh)
    assert any("2 vertices are far away" in note for note in report.notes)
    charted = charted_mesh(surface, mesh_charts(surface, 10.0))
    with pytest.raises(
        InputError, match=r"take 4,19\d,\d+ pieces of 0.05; allowed: .*stray vertices, such as"
    ):
        subdivided(charted, np.ones((3, 3, 3)) / np.sqrt(3), 0.05)
    ring, _ = unwrap(thin_ring(1e-4))
    with pytest.raises(InputError, match=r"charts of thin islands, such as .* texels for .* of the surface"):
        mesh_charts(ring, 5000.0)
    assert len(mesh_charts(ring, 500.0)) == 1
    net = pulled(1e6)
    with pytest.raises(InputError, match=r"face 0 is bent so unevenly that .* stray control points"):
        charted_patches(net, density_layout(net, texels=50_000))


@pytest.fixture
def far_file(tmp_path: Path) -> Path:
    lines = [f"v {x} {z} {-y}" for x, y, z in strip(1e5, 1e-6).positions.tolist()]
    (tmp_path / "far.obj").write_text("\n".join([*lines, "f 1 2 3", "f 1 3 4", "f 2 5 6"]))
    return tmp_path / "far.obj"


def test_info_names_strays(far_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    show_model(str(far_file))
    assert "note: 2 vertices are far away from the 4 others, at (100000, 0, 0)" in capsys.readouterr().out
    nets = {"patches": [{"points": pulled(1e9).patches[0].control_points.tolist()}]}
    (tmp_path / "far.json").write_text(json.dumps(nets))
    show_surface(str(tmp_path / "far.json"))
    assert "note: 1 control point is far away from the 15 others" in capsys.readouterr().out


def test_a_cover_names_strays_before_it_refuses_them(far_file: Path, tmp_path: Path) -> None:
    write_image(tmp_path / "x.png", np.random.default_rng(1).integers(0, 256, (48, 48, 3), dtype=np.uint8))
    told: list[str] = []
    with pytest.raises(InputError, match="pieces of"):
        cover(tmp_path / "x.png", far_file, tmp_path / "x.glb", tell=told.append)
    assert told[0].startswith("2 vertices are far away from the 4 others")
