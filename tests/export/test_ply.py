"""PLY files as other programs read them; and read back by ours."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from textured import make_model

from upholster.geometry.model_files.model_reader import read_model
from upholster.image.files.read import read_exemplar
from upholster.output.export.pages import PagedMesh
from upholster.output.export.ply import write_ply


@pytest.mark.parametrize("kind", ["cyclide", "sphere"])
def test_the_model_comes_back(tmp_path: Path, kind: str) -> None:
    model = make_model(kind)
    write_ply(
        tmp_path / "m.ply",
        tmp_path / "m_texture.png",
        PagedMesh(model.mesh, model.uv, model.pixels),
        stem="m",
    )
    found = read_model(tmp_path / "m.ply").mesh
    assert (found.neighbours >= 0).all()  # closed
    triangles = model.mesh.all_triangles()
    assert len(found.triangles) == len(triangles)
    assert found.areas.sum() == pytest.approx(_area(model.mesh.positions[triangles]), rel=1e-3)
    assert found.uv is not None
    assert found.normals is not None
    # Each corner has the texture coordinates and the normal of a vertex at its place.
    for row in np.random.default_rng(1).integers(0, len(found.triangles), 50):
        for corner in range(3):
            place = found.corners[row, corner]
            near = np.abs(model.mesh.positions - place).max(axis=1) < 1e-5
            assert np.abs(model.uv[near] - found.uv[row, corner]).max(axis=1).min() < 1e-6
            assert np.abs(model.mesh.normals[near] - found.normals[row, corner]).max(axis=1).min() < 1e-5
    np.testing.assert_array_equal(read_exemplar(tmp_path / "m_texture.png"), model.pixels)


def test_another_reader_sees_the_same(tmp_path: Path) -> None:
    model = make_model()
    write_ply(
        tmp_path / "m.ply",
        tmp_path / "m_texture.png",
        PagedMesh(model.mesh, model.uv, model.pixels),
        stem="m",
    )
    head = (tmp_path / "m.ply").read_bytes()[:400]
    assert b"comment TextureFile m_texture.png\n" in head
    other = trimesh.load(tmp_path / "m.ply", process=False, skip_texture=True)
    ours = read_model(tmp_path / "m.ply").mesh
    assert other.area == pytest.approx(ours.areas.sum(), rel=1e-4)
    np.testing.assert_allclose(other.bounds, ours.box, atol=1e-6)


def test_faces_of_two_pages_name_their_textures(tmp_path: Path) -> None:
    model = make_model()
    page = (model.mesh.chart % 2).astype(np.int32)
    files = [tmp_path / f"m_texture_{number}.png" for number in (1, 2)]
    write_ply(tmp_path / "m.ply", files, PagedMesh(model.mesh, model.uv, [model.pixels] * 2, page), stem="m")
    data = (tmp_path / "m.ply").read_bytes()
    assert data.count(b"comment TextureFile m_texture_") == 2
    kind = [("n", "u1"), ("v", "<i4", 4), ("m", "u1"), ("uv", "<f4", 8), ("page", "<i4")]
    rows = np.frombuffer(data, kind, len(model.mesh.quads), data.index(b"end_header\n") + 11 + 32 * len(page))
    np.testing.assert_array_equal(rows["page"], page[rows["v"][:, 0]])
    assert len(np.unique(rows["page"])) == 2


def _area(corners: np.ndarray) -> float:
    a, b, c = corners.transpose(1, 0, 2)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
