"""Colours of vertices: from each format that has them, and nothing else changes by them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import BOX, BOX_FACES, BOX_TRIANGLES, Glb

from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.model_files.model_reader import read_model

COLORS = np.round(np.random.default_rng(4).random((8, 3)) * 255).astype(np.uint8)


def coloured(path: Path, upright: bool = False) -> None:
    """Check that each corner of a box has the colour of its vertex."""
    model = read_model(path)
    corners = model.mesh.corners
    if upright:  # y was up in the file
        corners = np.stack([corners[..., 0], corners[..., 2], -corners[..., 1]], axis=-1)
    vertex = np.abs(corners[:, :, None] - BOX).sum(axis=3).argmin(axis=2)
    assert model.colors is not None
    assert model.colors.dtype == np.float32
    np.testing.assert_allclose(model.colors, COLORS[vertex] / 255, atol=1e-6)


def scaled(scale: float) -> list[list[float]]:
    """Return the colours times a number; whole numbers stay such."""
    return (COLORS.astype(int if scale >= 1 else float) * scale).tolist()


def box_with(glb: Glb, colors: np.ndarray, **more: Any) -> dict[str, Any]:
    return glb.box(COLOR_0=glb.accessor(colors, **more))


@pytest.mark.parametrize("width", [3, 4])
@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
def test_gltf_has_colours_of_three_types(tmp_path: Path, kind: str, width: int) -> None:
    values = np.concatenate([COLORS, np.full((8, width - 3), 9, np.uint8)], axis=1)
    if kind == "uint16":
        values = values.astype(np.uint16) * 257
    if kind == "float32":
        values = (values / 255).astype(np.float32)
    glb = Glb()
    glb.node(mesh=glb.mesh("box", box_with(glb, values, normalized=kind != "float32")))
    coloured(glb.write(tmp_path / "box.glb"), upright=True)


def test_parts_without_colours_have_none(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("box", box_with(glb, COLORS.astype(np.float32) / 255)), scale=[1, 1, -1])
    glb.node(mesh=glb.mesh("bare", glb.box()))
    path = glb.write(tmp_path / "two.glb")
    colors = read_model(path).colors
    assert colors is not None
    assert np.isfinite(colors[:12]).all()
    assert np.isnan(colors[12:]).all()


def test_colours_that_break_the_format_are_none(tmp_path: Path) -> None:
    glb = Glb()
    glb.node(mesh=glb.mesh("box", box_with(glb, COLORS[:, :2].astype(np.float32))))
    assert read_model(glb.write(tmp_path / "box.glb")).colors is None


def ply(kind: str, scale: float) -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 8\n" + "".join(f"property float {c}\n" for c in "xyz")
    head += "".join(f"property {kind} {c}\n" for c in ("red", "green", "blue"))
    head += "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, [*p, *c])) for p, c in zip(BOX.tolist(), scaled(scale), strict=True)]
    faces = ["4 " + " ".join(map(str, face)) for face in BOX_FACES.tolist()]
    return (head + "\n".join([*rows, *faces]) + "\n").encode()


@pytest.mark.parametrize(("kind", "scale"), [("uchar", 1), ("ushort", 257), ("float", 1 / 255)])
def test_ply_has_colours(tmp_path: Path, kind: str, scale: float) -> None:
    path = tmp_path / "box.ply"
    path.write_bytes(ply(kind, scale))
    coloured(path)


@pytest.mark.parametrize("scale", [1, 1 / 255])
@pytest.mark.parametrize("weight", ["", " 1"])
def test_obj_has_colours_behind_positions(tmp_path: Path, scale: float, weight: str) -> None:
    rows = [
        f"v {' '.join(map(str, p))}{weight} {' '.join(map(str, c))}"
        for p, c in zip(BOX.tolist(), scaled(scale), strict=True)
    ]
    faces = ["f " + " ".join(str(k + 1) for k in face) for face in BOX_FACES.tolist()]
    path = tmp_path / "box.obj"
    path.write_text("\n".join([*rows, *faces]) + "\n")
    coloured(path, upright=True)


@pytest.mark.parametrize("normal", ["", " 0 0 1"])
def test_off_has_colours(tmp_path: Path, normal: str) -> None:
    rows = [
        f"{' '.join(map(str, p))}{normal} {' '.join(map(str, c))} 255"
        for p, c in zip(BOX.tolist(), COLORS.tolist(), strict=True)
    ]
    faces = ["3 " + " ".join(map(str, face)) for face in BOX_TRIANGLES.tolist()]
    path = tmp_path / "box.off"
    path.write_text("\n".join([f"C{'N' if normal else ''}OFF", "8 12 0", *rows, *faces]) + "\n")
    coloured(path)


def test_nothing_else_changes_by_colours(tmp_path: Path) -> None:
    models: list[ModelFile] = []
    for colors in ({}, {"COLOR_0": COLORS.astype(np.float32)}):
        glb = Glb()
        attributes = {name: glb.accessor(values) for name, values in colors.items()}
        glb.node(mesh=glb.mesh("box", glb.box(**attributes)))
        models.append(read_model(glb.write(tmp_path / "box.glb")))
    plain, other = models
    np.testing.assert_array_equal(plain.mesh.positions, other.mesh.positions)
    np.testing.assert_array_equal(plain.mesh.triangles, other.mesh.triangles)
    assert plain.colors is None
