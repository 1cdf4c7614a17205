"""USDZ files, opened and checked by Pixar's own library; without it these tests are skipped."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.output.export.usdz import write_usdz

EXAMPLES = Path(__file__).parents[2] / "examples"


def checked(path):
    """Open a file, and return its stage; nothing is wrong with it."""
    from pxr import Usd, UsdValidation

    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [(error.GetName(), error.GetMessage()) for error in found] == []
    return stage


@pytest.fixture(scope="module")
def chair(tmp_path_factory):
    pytest.importorskip("pxr")
    folder = tmp_path_factory.mktemp("usd")
    upholster.cover(
        EXAMPLES / "granite.png", EXAMPLES / "chair.glb", [folder / "chair.usdz", folder / "chair.glb"],
        materials={"Seat": EXAMPLES / "bricks_material"}, synthesis={"texels": 60_000},
    )  # fmt: skip
    return folder


@pytest.mark.slow(reason="writes and reads whole models")
def test_a_model_with_several_materials_is_the_same_in_usdz(chair):
    from pxr import UsdGeom, UsdShade

    stage = checked(chair / "chair.usdz")
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    wanted = upholster.geometry.model_files.model_reader.read_model(chair / "chair.glb")
    assert {p.GetDisplayName() for p in stage.GetDefaultPrim().GetChildren() if p.IsA(UsdGeom.Xform)} >= {
        "Seat"
    }
    corners, used = [], set()
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(), np.float64)
        matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
        points = points @ matrix[:3, :3] + matrix[3, :3]
        corners.append(points[np.array(mesh.GetFaceVertexIndicesAttr().Get())])
        used.add(UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPath().name)
        assert len(UsdGeom.PrimvarsAPI(prim).GetPrimvar("st").Get()) == len(points)
    found = np.concatenate(corners)[:, [0, 2, 1]] * (1, -1, 1)
    np.testing.assert_allclose(
        np.sort(found, axis=0), np.sort(wanted.mesh.corners.reshape(-1, 3), axis=0), atol=1e-5
    )
    assert used == {"granite", "bricks_material"}


def test_a_surface_and_its_maps_are_there(tmp_path):
    pytest.importorskip("pxr")
    from pxr import UsdShade

    upholster.cover(
        EXAMPLES / "bricks_material", "torus", [tmp_path / "ring.usdz", tmp_path / "again.usdz"],
        synthesis={"texels": 40_000}, options=upholster.WriteOptions(quads=500, texture="webp"),
    )  # fmt: skip
    assert (tmp_path / "ring.usdz").read_bytes() == (tmp_path / "again.usdz").read_bytes()
    data = (tmp_path / "ring.usdz").read_bytes()
    with zipfile.ZipFile(tmp_path / "ring.usdz") as archive:
        assert archive.testzip() is None
        for entry in archive.infolist():  # the date stands twice; neither may be that of the day
            assert entry.date_time == (1980, 1, 1, 0, 0, 0)
            assert data[entry.header_offset + 10 : entry.header_offset + 14] == bytes([0, 0, 33, 0])
    stage = checked(tmp_path / "ring.usdz")
    surface = next(
        shader
        for shader in map(UsdShade.Shader, stage.Traverse())
        if shader and shader.GetIdAttr().Get() == "UsdPreviewSurface"
    )
    for name in ("diffuseColor", "normal", "roughness"):
        source = surface.GetInput(name).GetConnectedSources()[0][0].source.GetPrim()
        file = UsdShade.Shader(source).GetInput("file").Get()
        assert file.path.endswith(".png")
        assert file.resolvedPath.startswith(str(tmp_path))


def test_without_the_library_a_line_says_what_to_install(monkeypatch, tmp_path):
    hidden = tmp_path / "hidden" / "pxr"
    hidden.mkdir(parents=True)
    (hidden / "__init__.py").write_text("raise ModuleNotFoundError('no pxr', name='pxr')\n")
    monkeypatch.syspath_prepend(str(hidden.parent))
    monkeypatch.delitem(__import__("sys").modules, "pxr", raising=False)
    with pytest.raises(upholster.InputError, match=r"pip install 'upholster\[usd\]'"):
        write_usdz(tmp_path / "a.usdz", b"")
    done = run_cli("cover", EXAMPLES / "granite.png", "--on", "torus", "-o", "a.usdz", cwd=tmp_path)
    assert_one_line(done, "upholster[usd]")
