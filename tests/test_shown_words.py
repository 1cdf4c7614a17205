"""What files are called, and what they say of themselves, is shown as it is, and never obeyed."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import run_cli
from gltf_models import Glb

import upholster
from upholster.apps import cli
from upholster.base.display import number_of
from upholster.base.errors import InputError, printable
from upholster.codec.stream.writer import encode_stream

EVIL = "\x1b]0;mine\x07[bold]x[/foo]\u202e\r"
SHOWN = r"\x1b]0;mine\x07[bold]x[/foo]\u202e"


@pytest.fixture(scope="module")
def example_stream() -> bytes:
    exemplar = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    surface = upholster.torus(3, 1)
    return encode_stream(surface, upholster.synthesize(exemplar, surface, chart=64, method="paper"), exemplar)


def test_what_does_not_print_is_escaped() -> None:
    assert printable("plain text, Größe 3 µm") == "plain text, Größe 3 µm"
    assert printable(EVIL) == SHOWN + r"\r"
    assert printable("a\udcffb\x9b1m") == r"a\udcffb\x9b1m"
    assert printable(printable(EVIL)) == printable(EVIL)
    assert str(InputError(f"part {EVIL} is odd")) == f"part {SHOWN} is odd"  # line ends are spaces


@pytest.mark.slow(reason="starts processes")
def test_files_with_odd_names(tmp_path: Path, example_stream: Any) -> None:
    name = "[bold]x[foo]\x1b[2J.uph"
    (tmp_path / name).write_bytes(example_stream)
    reported = run_cli("info", name, cwd=tmp_path)
    assert reported.returncode == 0, reported.stderr
    assert reported.stdout.startswith(r"[bold]x[foo]\x1b[2J.uph: ")
    reported = run_cli("refine", name, "-o", "[red]y[foo]\x1b[2J.png", cwd=tmp_path)
    assert reported.returncode == 0, reported.stderr
    assert r"wrote [red]y[foo]\x1b[2J.png" in reported.stdout
    (tmp_path / name).write_bytes(b"no stream")
    reported = run_cli("info", name, cwd=tmp_path)
    assert reported.returncode == 2
    for text in (reported.stdout, reported.stderr):
        assert "\x1b" not in text


def test_a_model_with_odd_names(tmp_path: Path) -> None:
    glb = Glb(materials=[{"name": EVIL}])
    primitive = glb.box()
    primitive["material"] = 0
    glb.node(name=EVIL, mesh=glb.mesh(EVIL, primitive))
    glb.write(tmp_path / "odd.glb")
    reported = run_cli("info", "odd.glb", cwd=tmp_path)
    assert reported.returncode == 0, reported.stderr
    assert "\x1b" not in reported.stdout
    assert r"\x1b]0;mine" in reported.stdout.replace(" ", "")


@pytest.mark.slow(reason="starts processes")
def test_names_that_cannot_be_encoded(tmp_path: Path, example_stream: Any) -> None:
    odd = b"x\xff.uph"
    (Path(str(tmp_path)) / "x\udcff.uph").write_bytes(example_stream)
    done = subprocess.run(
        [sys.executable, "-m", "upholster", "info", odd], cwd=tmp_path, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(rb"x\udcff.uph: ")


def test_an_unforeseen_fault_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("what nobody\nthought of")

    ended: list[int] = []
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(cli, "app", broken)
    monkeypatch.setattr("os._exit", ended.append)
    cli.main()
    (reported,) = capsys.readouterr().err.splitlines()
    (file,) = tmp_path.glob("upholster-fault-*.txt")
    assert ended == [1]
    assert "report it" in reported
    assert str(file) in reported
    assert "ZeroDivisionError: what nobody thought of" in reported
    assert "in broken" in file.read_text()


def test_numbers_of_things() -> None:
    assert number_of(1, "part") == "1 part"
    assert [number_of(n, "body", "bodies") for n in (0, 1, 1234)] == ["0 bodies", "1 body", "1,234 bodies"]
