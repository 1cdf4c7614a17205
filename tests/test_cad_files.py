"""CAD files read, told and covered. The files are made here; without Open CASCADE these tests are skipped."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cad_models import part, write_step
from command_line import assert_one_line, run_cli

from upholster.base.errors import InputError
from upholster.charts.axis_directions import axis_direction, closed_rounds
from upholster.charts.creases import CREASE
from upholster.charts.directions.field import direction_field
from upholster.charts.part_directions import part_direction
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.occt.process import read_cad
from upholster.runtime.parallel import running

OCP = pytest.importorskip("OCP")

SAMPLE = Path(__file__).parents[1] / "examples/granite.png"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """An assembly: the plate twice, and a ball."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.BRepTools import BRepTools
    from OCP.IGESControl import IGESControl_Writer

    folder = tmp_path_factory.mktemp("cad")
    plate = part()
    write_step(
        folder / "two.step",
        [
            ("plate", (1, 0, 0), plate, [(0, 0, 0), (0, 0, 30)]),
            ("ball", (0, 0, 1), BRepPrimAPI_MakeSphere(6).Shape(), [(60, 0, 0)]),
        ],
    )
    BRepTools.Write_s(plate, str(folder / "plate.brep"))
    writer = IGESControl_Writer("MM", 0)
    writer.AddShape(plate)
    writer.Write(str(folder / "plate.igs"))
    # A name in UTF-8 whose length counts characters, as some programs write it: not the length in bytes.
    data = (folder / "plate.igs").read_bytes()
    assert b"13HFilename.iges" in data
    (folder / "plate.igs").write_bytes(data.replace(b"13HFilename.iges", "12HFilenäm.iges".encode()))
    return folder


@pytest.fixture(scope="module")
def two(files):
    """The assembly as it is read: that takes a process of some seconds."""
    return read_cad(files / "two.step")


@pytest.fixture(scope="module")
def model(files):
    """The assembly as a mesh."""
    return read_model(files / "two.step")


@pytest.fixture(scope="module")
def plate(files):
    """The plate alone as a mesh, of a file without a unit."""
    return read_model(files / "plate.brep")


AREA = 2 * (40 * 20 + 40 * 10 + 20 * 10) - 2 * 16 * np.pi + 8 * np.pi * 10 - 10 * 6 + 10 * 3 * np.pi / 2
"""Of the plate, but for the corners that the rounding takes from two sides."""


def test_step_is_read_with_unit_names_colours_and_places(files, two):
    assert (two.format, two.unit) == ("STEP", "millimetre")
    assert [body.name for body in two.bodies] == ["plate", "ball"]
    assert [body.colour for body in two.bodies] == ["#ff0000", "#0000ff"]
    assert [[place.name for place in body.places] for body in two.bodies] == [
        ["plate 1", "plate 2"],
        ["ball 1"],
    ]
    plate, ball = two.bodies
    assert sorted(face.kind for face in plate.faces) == ["cylinder"] * 2 + ["plane"] * 6
    np.testing.assert_allclose(plate.places[1].matrix[:, 3], [0, 0, 30], atol=1e-9)
    assert sum(face.area for face in ball.faces) == pytest.approx(4 * np.pi * 36, rel=1e-3)
    assert len(read_cad(files / "two.step", unique=True).bodies) == 3


def test_triangles_are_watertight_and_on_the_faces(model):
    mesh = model.mesh
    assert mesh.metres == 0.001
    assert mesh.parts == ("plate 1", "ball 1")
    assert [part.material for part in model.parts] == ["#ff0000", "#0000ff"]
    assert model.parts[0].instances == 2
    assert (mesh.neighbours >= 0).all()
    ball = mesh.part == 1
    centred = mesh.corners[ball] - (60, 0, 0)
    np.testing.assert_allclose(np.linalg.norm(centred, axis=2), 6, atol=1e-5)
    np.testing.assert_allclose(mesh.normals[ball], centred / 6, atol=1e-5)
    plate = mesh.areas[~ball].sum()
    assert plate == pytest.approx(AREA, rel=2e-3)
    # Axes: of the hole and of the rounding, and of nothing else.
    named = model.axes[~ball][:, 1]
    assert set(map(tuple, np.abs(named).round(6))) == {(0, 0, 0), (0, 0, 1)}


def test_faces_share_vertices_on_trimming_curves(two):
    plate = two.bodies[0]
    hole = next(face for face in plate.faces if face.kind == "cylinder" and face.area > 60)
    rim = np.unique(hole.vertices[plate.rim[hole.vertices]])
    at = plate.positions[rim]
    round_ = at[(np.abs(at[:, 2]) < 1e-9) | (np.abs(at[:, 2] - 10) < 1e-9)]
    assert len(round_) > 60  # two circles
    np.testing.assert_allclose(np.linalg.norm(round_[:, :2] - (20, 10), axis=1), 4, atol=1e-9)
    # Both circles belong to the plane beside as well: no vertex of an edge has a twin.
    beside = [face for face in plate.faces if face.kind == "plane"]
    shared = np.unique(np.concatenate([face.vertices for face in beside]))
    assert np.isin(rim[np.isin(at, round_).all(axis=1)], shared).all()
    used = np.unique(np.concatenate([face.vertices for face in plate.faces]))
    places = plate.positions[used].round(9)
    assert len(np.unique(places, axis=0)) == len(used)


def test_brep_and_iges_give_the_same_plate(files, two, plate):
    wanted = sum(face.area for face in two.bodies[0].faces)
    assert any("no unit: millimetres assumed" in note for note in plate.notes)
    assert plate.mesh.areas.sum() == pytest.approx(wanted, rel=2e-3)
    larger = read_model(files / "plate.brep", unit="cm")
    assert larger.mesh.size == pytest.approx(10 * plate.mesh.size, rel=1e-6)
    iges = read_model(files / "plate.igs")
    assert (iges.mesh.neighbours >= 0).all()  # loose faces are sewn
    assert iges.mesh.areas.sum() == pytest.approx(wanted, rel=2e-3)
    assert read_cad(files / "plate.igs").unit == "millimetre"
    with pytest.raises(InputError, match="states its unit itself"):
        read_model(files / "plate.igs", unit="mm")


def test_shapes_without_a_product_are_read_plainly(files, two, tmp_path):
    lines = (files / "two.step").read_text().replace("\n ", " ").splitlines()
    gone = re.compile(
        r"#\d+ ?= ?\(? ?(PRODUCT|APPLICATION|SHAPE_DEF|NEXT_|CONTEXT_DEP|ITEM_DEF|MECHANICAL|STYLED|"
        r"SHAPE_REPRESENTATION_REL|REPRESENTATION_REL|SHAPE_REPRESENTATION\()"
    )
    (tmp_path / "bare.step").write_text("\n".join(line for line in lines if not gone.match(line)))
    bare = read_cad(tmp_path / "bare.step")
    assert (bare.unit, [body.name for body in bare.bodies]) == ("millimetre", ["bare", "bare"])
    assert any("without names" in note for note in bare.notes)
    areas = [sorted(face.area for body in one.bodies for face in body.faces) for one in (two, bare)]
    np.testing.assert_allclose(areas[0], areas[1])


def test_a_smaller_deviation_gives_more_triangles(files, model):
    coarse = read_model(files / "two.step", deviation="1mm")
    assert len(model.mesh.triangles) > 2 * len(coarse.mesh.triangles)
    with pytest.raises(InputError, match="deviation is"):
        read_model(files / "two.step", deviation="-1mm")


def test_up_can_be_set(files, plate):
    z, y = plate.mesh, read_model(files / "plate.brep", up="y").mesh
    np.testing.assert_allclose(y.positions, z.positions[:, [0, 2, 1]] * (1, -1, 1), atol=1e-5)


def test_info_tells_what_there_is(files):
    done = run_cli("info", "two.step", cwd=files)
    assert done.returncode == 0
    assert "STEP, 2 bodies in 3 places, 9 faces" in done.stdout
    assert "the file's unit: millimetre" in done.stdout
    assert "every face can be covered" in done.stdout


def test_cover_writes_a_model_with_names_and_a_part_alone(files, tmp_path):
    done = run_cli(
        "cover", SAMPLE, "--on", files / "two.step", "--part", "plate*", "--sample-size", "20mm",
        "--texels", "100k", "-o", tmp_path / "part.glb",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    data = (tmp_path / "part.glb").read_bytes()
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    names = [node["name"] for node in document["nodes"]]
    assert names == ["plate 1", "plate 2", "ball 1", "model"]
    assert sorted(material.get("name") for material in document["materials"]) == ["#0000ff", "two"]


def test_bad_files_are_one_line(files, tmp_path):
    (tmp_path / "empty.step").write_bytes(b"")
    (tmp_path / "noise.brep").write_bytes(b"nothing of the kind")
    (tmp_path / "bare.step").write_text(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    for name, said in (
        ("noise.brep", "BREP file that Open CASCADE can read"),
        ("bare.step", "allowed: a model with some"),
        ("none.step", "does not exist"),
    ):
        assert_one_line(run_cli("info", name, cwd=tmp_path), said)
    for name, said in (("empty.step", "empty"), ("none.step", "does not exist")):
        assert_one_line(run_cli("cover", SAMPLE, "--on", name, "-o", "a.glb", cwd=tmp_path), said)
    assert not (tmp_path / "a.glb").exists()


def test_progress_is_reported_by_face(files, monkeypatch, tmp_path):
    reported = []
    with running(progress=lambda *one: reported.append(one)):
        read_model(files / "two.step")
    assert {("faces", 9, 9), ("mesh", 9, 9)} <= set(reported)
    for stage in ("faces", "mesh"):  # body by body, told now and then: a slow machine tells more
        done = [count for name, count, _ in reported if name == stage]
        assert done == sorted(done)
    begun, popen = [], subprocess.Popen
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("subprocess.Popen", lambda *a, **k: begun.append(popen(*a, **k)) or begun[-1])
    stopping = running(progress=lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt), stopping:
        read_model(files / "two.step")
    assert begun[0].poll() is not None
    assert not list(tmp_path.iterdir())


def test_a_stop_in_the_middle_of_waiting_does_not_hang(files, monkeypatch, tmp_path):
    begun, popen = [], subprocess.Popen

    def stop(*_):
        begun[0]._waitpid_lock.acquire()  # as Python leaves it if the signal comes right after it is acquired
        raise KeyboardInterrupt

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("subprocess.Popen", lambda *a, **k: begun.append(popen(*a, **k)) or begun[-1])
    with pytest.raises(KeyboardInterrupt), running(progress=stop):
        read_model(files / "two.step")
    begun[0]._waitpid_lock.release()
    assert begun[0].wait(10) == -signal.SIGKILL
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_ctrl_c_while_reading_is_one_line_and_leaves_nothing(files, tmp_path):
    left = tmp_path / "left"
    left.mkdir()
    process = subprocess.Popen(
        [sys.executable, "-m", "upholster", "cover", SAMPLE, "--on", files / "two.step", "-q", "-o", "a.glb"],
        cwd=tmp_path, env=os.environ | {"TMPDIR": str(left)}, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    while not list(left.glob("upholster-*")) and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the process that reads gets it as well
    said = process.communicate()[1]
    assert (process.returncode, said) == (130, "upholster: stopped, nothing written\n")
    assert not list(left.iterdir())
    assert not (tmp_path / "a.glb").exists()


def test_limits_are_kept(files):
    with pytest.raises(InputError, match=r"takes more than 0.01 s"):
        read_cad(files / "two.step", seconds=0.01)
    with pytest.raises(InputError, match=r"needs more than 0.293 GiB of memory to read"):
        read_cad(files / "two.step", memory=300 << 20)


@pytest.mark.parametrize(
    ("limit", "value", "said"),
    [("SECONDS", 0.01, "takes more than 0.01 s to read"), ("MEMORY", 100 << 20, "0.0977 GiB of memory")],
)
def test_out_of_time_or_memory_is_one_line_and_writes_nothing(
    files, monkeypatch, tmp_path, limit, value, said
):
    monkeypatch.setattr(f"upholster.geometry.occt.process.{limit}", value)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    done = run_cli("cover", SAMPLE, "--on", files / "two.step", "-q", "-o", "a.glb", cwd=tmp_path)
    assert_one_line(done, said)
    assert_one_line(run_cli("info", files / "two.step", cwd=tmp_path), said)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("does", "said"),
    [
        ("kill -SEGV $$", r"Open CASCADE crashes on it \(SIGSEGV\): it cannot be read"),
        ("kill -KILL $$", "it cannot be read: the system ended the process .* if memory is short"),
        ("kill -XCPU $$", "it cannot be read: it takes too much processor time"),
        ("echo 'what(): std::bad_alloc' >&2; kill -ABRT $$", "it needs more than 12 GiB of memory to read"),
        (
            "echo 'OSError: No space left' >&2; exit 1",
            "the process that reads it fails: OSError: No space left",
        ),
    ],
)
def test_a_crash_is_one_line_and_nothing_else_is_called_one(files, monkeypatch, tmp_path, does, said):
    fake = tmp_path / "python"
    fake.write_text(f"#!/bin/sh\n{does}\n")
    fake.chmod(0o755)
    monkeypatch.setattr("upholster.geometry.occt.process.sys.executable", str(fake))
    with pytest.raises(InputError, match=said):
        read_cad(files / "two.step")


def test_deviation_is_for_cad_models_alone(tmp_path):
    (tmp_path / "a.stl").write_bytes(b"x")
    with pytest.raises(InputError, match="are for CAD models"):
        read_model(tmp_path / "a.stl", deviation=1)


def test_3dm_keeps_layers_colours_and_blocks(tmp_path):
    rhino = pytest.importorskip("rhino3dm")
    model = rhino.File3dm()
    model.Settings.ModelUnitSystem = rhino.UnitSystem.Centimeters
    layer = rhino.Layer()
    layer.Name = "metal"
    layer.Color = (10, 200, 30, 255)
    known = rhino.ObjectAttributes()
    known.LayerIndex = model.Layers.Add(layer)
    known.Name = "globe"
    ball = rhino.Sphere(rhino.Point3d(1, 2, 3), 0.5)
    model.Objects.AddBrep(ball.ToBrep(), known)
    cylinder = rhino.Cylinder(rhino.Circle(rhino.Point3d(0, 0, 0), 1.0), 4.0)
    model.Objects.AddBrep(cylinder.ToBrep(True, True), None)
    path = tmp_path / "things.3dm"
    model.Write(str(path), 7)
    found = read_cad(path)
    assert found.unit == "centimeters"
    assert (found.bodies[0].name, found.bodies[0].layer) == ("globe", "metal")
    areas = [sum(face.area for face in body.faces) for body in found.bodies]
    np.testing.assert_allclose(areas, [100 * np.pi, 800 * np.pi + 200 * np.pi], rtol=1e-3)
    read = read_model(path)
    globe = np.isin(read.mesh.part, read.fitting(["globe"]))
    np.testing.assert_allclose(np.linalg.norm(read.mesh.corners[globe] - (10, 20, 30), axis=2), 5, atol=1e-4)
    assert (read.mesh.neighbours >= 0).all()


def test_3dm_objects_need_no_layer(tmp_path):
    rhino = pytest.importorskip("rhino3dm")
    model = rhino.File3dm()
    model.Objects.AddSphere(rhino.Sphere(rhino.Point3d(0, 0, 0), 5))
    model.Write(str(tmp_path / "ball.3dm"), 7)
    (body,) = read_cad(tmp_path / "ball.3dm").bodies
    assert body.layer == ""


@pytest.mark.parametrize("name", ["part.step", "part.3dm"])
def test_an_extra_that_is_missing_is_named(monkeypatch, tmp_path, name):
    Path(tmp_path, name).write_text("x")
    hidden = tmp_path / "hidden" / "OCP"
    hidden.mkdir(parents=True)
    (hidden / "__init__.py").write_text("raise ModuleNotFoundError('no OCP', name='OCP')\n")
    monkeypatch.setenv("PYTHONPATH", str(hidden.parent))
    with pytest.raises(InputError, match=r"pip install 'upholster\[cad\]'"):
        read_cad(tmp_path / name)


def test_directions_along_and_around_follow_each_face_own_axis(plate):
    along, around = (axis_direction(plate, kind) for kind in ("along", "around"))
    centres = plate.mesh.corners.mean(axis=1)
    hole = np.abs(np.linalg.norm(centres[:, :2] - (20, 10), axis=1) - 4) < 0.1
    hole &= np.abs(plate.mesh.flat_normals[:, 2]) < 0.1
    np.testing.assert_allclose(along[hole], np.tile([0, 0, 1], (hole.sum(), 1)), atol=1e-6)
    np.testing.assert_allclose(around[hole, 2], 0, atol=1e-6)
    toward = np.append((20, 10), 0) - centres[hole]
    assert np.abs((around[hole] * toward).sum(axis=1)).max() < 0.2
    (found,) = closed_rounds(plate)  # the hole; the rounding is a quarter
    assert found.length == pytest.approx(8 * np.pi, rel=2e-3)
    assert found.area == pytest.approx(80 * np.pi, rel=2e-3)


def test_plane_faces_have_one_direction(plate):
    mesh = plate.mesh
    caps, sides = [(0, 0, 1), (0, 0, -1)], [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
    around = part_direction(plate, "around")
    for direction, lattice, straight in ((None, False, caps + sides), (around, True, caps)):
        found = direction_field(mesh, direction, crease=CREASE, lattice=lattice).corner_vectors
        for side in (mesh.flat_normals @ way > 1 - 1e-9 for way in straight):
            one = found[side].reshape(-1, 3)
            np.testing.assert_allclose(one, one[:1].repeat(len(one), axis=0), atol=1e-3)
            assert abs(one[0]).max() > 1 - 1e-6
    found = direction_field(mesh, around, crease=CREASE).face_vectors
    round_it = np.cross((0, 0, 1), mesh.corners.mean(axis=1) - (20, 10, 0))
    round_it /= np.linalg.norm(round_it, axis=1, keepdims=True)
    top = mesh.flat_normals[:, 2] > 1 - 1e-9
    assert np.abs((found * round_it).sum(axis=1))[top].min() > 0.9


def test_each_part_may_have_a_direction_of_its_own(files, model, tmp_path):
    mesh = model.mesh
    centres, ball = mesh.corners.mean(axis=1), np.isin(mesh.part, model.fitting(["ball*"]))
    asked = part_direction(model, {"Ball*": "0,1,0", "plate 1": "along"})
    found = asked(centres)
    np.testing.assert_allclose(found[ball], np.tile([0, 1, 0], (ball.sum(), 1)))
    np.testing.assert_allclose(found[~ball], axis_direction(model, "along")[~ball])
    assert asked.__name__ == "Ball*=0,1,0, plate 1=along"
    some = part_direction(model, {"ball*": "x", "*": "level"})(centres)
    np.testing.assert_allclose(some[ball], np.tile([1, 0, 0], (ball.sum(), 1)))
    np.testing.assert_allclose(some[~ball][:, 2], 0, atol=1e-9)
    nothing = part_direction(model, {"ball 1": "around:z"})(centres)
    assert not nothing[~ball].any()
    with pytest.raises(ValueError, match="one mesh"):
        asked(centres + 1)
    with pytest.raises(InputError, match="no part is called 'Lid'"):
        part_direction(model, {"Lid": "x"})
    with pytest.raises(InputError, match="is for a part; allowed there: along"):
        part_direction(model, {"*": "curvature"})
    words = ["cover", SAMPLE, "--on", files / "two.step", "-o", tmp_path / "a.png", "--texels", "60k"]
    done = run_cli(*words, "--size", "64x64", "--direction", "ball*=around", "--direction", "along")
    assert done.returncode == 0, done.stderr
    assert "direction ball*=around, *=along" in done.stdout
    assert_one_line(run_cli(*words, "--direction", "x=", cwd=tmp_path), "allowed: PART=VALUE")


def test_axes_are_for_cad_models(files, tmp_path):
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    for words in (["--on", "a.off", "--direction", "along"], ["--on", "torus", "--direction", "around"]):
        assert_one_line(run_cli("cover", SAMPLE, *words, "-o", "a.png", cwd=tmp_path), "direction is")
    assert_one_line(
        run_cli("cover", SAMPLE, "--on", "a.off", "--fit", "-o", "a.png", cwd=tmp_path), "fit is given"
    )
