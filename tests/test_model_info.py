"""``upholster info`` of a model."""

from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from gltf_models import Glb

from upholster.output.export.three_mf import write_3mf


def test_info_tells_parts_and_sizes(tmp_path: Path) -> None:
    glb = Glb(materials=[{"name": "Oak"}])
    glb.node(name="Seat", mesh=glb.mesh("seat", glb.box() | {"material": 0}), scale=[0.4, 0.4, 0.4])
    mesh = glb.mesh("leg", glb.box(COLOR_0=glb.accessor(np.ones((8, 4), np.float32))))
    for x in (2, 3):
        glb.node(name=f"Leg {x}", mesh=mesh, translation=[x, 0, 0], scale=[x, x, x])
    glb.write(tmp_path / "chair.glb")
    done = run_cli("info", "chair.glb", cwd=tmp_path)
    assert done.returncode == 0
    assert "24 triangles, 16 vertices, 2 parts" in done.stdout
    assert "a unit is 1 m; y is up in the file" in done.stdout
    assert "Oak" in done.stdout
    assert "9,600 cm²" in done.stdout
    assert "Leg 2: 2 instances, vertex colours" in done.stdout
    assert "note: 'Leg 2' is shown 2 times at different sizes (1.5 times the first)" in done.stdout
    shown = run_cli("info", "chair.glb", "--unit", "mm", cwd=tmp_path).stdout
    assert "a unit is 0.001 m" in shown


@pytest.mark.parametrize(("columns", "lines"), [(70, 3), (200, 1)])
def test_names_stand_whole_on_a_line_however_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, columns: int, lines: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    names = {"Chair_Collection/Cushion_Back_Left_Brown": "Leather_Brown_Rough_2024", "Leg": "Oak"}
    glb = Glb(materials=[{"name": material} for material in names.values()])
    for n, part in enumerate(names):
        glb.node(name=part, mesh=glb.mesh(part, glb.box() | {"material": n}))
    glb.write(tmp_path / "chair.glb")
    reported = [line.strip() for line in run_cli("info", "chair.glb", cwd=tmp_path).stdout.splitlines()]
    for part, material in names.items():
        first = next(n for n, line in enumerate(reported) if line.startswith(part))
        place = " ".join(reported[first : first + lines])
        assert material in place
        assert all(word in place for word in (part, "12", " m²", " m", "none"))
        assert all(len(line) <= columns for line in reported[first : first + lines])


def test_info_refuses_what_is_no_model(tmp_path: Path) -> None:
    (tmp_path / "empty.stl").write_bytes(b"")
    (tmp_path / "points.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"
    )
    for words, said in (
        (["empty.stl"], "empty.stl: is empty"),
        (["points.ply"], "points.ply: it has no vertices with x, y and z"),
        (["none.obj"], "'none.obj' does not exist"),
        (["empty.stl", "--unit", "yard"], "unit 'yard' is unknown"),
        (["a.uph", "--unit", "mm"], "--unit is for models"),
    ):
        done = run_cli("info", *words, cwd=tmp_path)
        assert done.returncode == 2, words
        assert said in done.stderr
        assert done.stderr.count("\n") == 1


def test_info_names_the_kinds_it_knows_for_an_unknown_suffix(tmp_path: Path) -> None:
    (tmp_path / "thing.abc").write_bytes(b"PK\3\4 and more")
    done = run_cli("info", "thing.abc", cwd=tmp_path)
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert "'thing.abc' is no stream and has suffix '.abc'; allowed: .uph, .glb" in said


def test_info_describes_a_3mf(tmp_path: Path) -> None:
    write_3mf(tmp_path / "tile.3mf", np.eye(3) * 20, np.array([[0, 1, 2]]), name="Tile")
    done = run_cli("info", "tile.3mf", cwd=tmp_path)
    assert done.returncode == 0
    assert "1 triangle, 3 vertices, 1 part" in done.stdout
    assert "2 x 2 x 2 cm" in done.stdout
    assert "Tile" in done.stdout
