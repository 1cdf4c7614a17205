"""No command writes over a file that it reads, whatever the file is called: refused before work begins."""

import os
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.nets import write_nets

import upholster
from upholster import pipeline
from upholster.apps import cli
from upholster.base.errors import InputError
from upholster.codec.ezw import encode
from upholster.covering import request
from upholster.image.files.material import Material
from upholster.image.files.source import source_files
from upholster.image.files.write import write_image
from upholster.output import output_writer

STREAM = Path(__file__).parent / "vectors" / "quilt.uph"
ROLES = ("albedo", "normal", "roughness")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One input of every kind, and links to some; the current folder."""
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    (tmp_path / "wall").mkdir()
    for role in ROLES:
        shown = pixels[..., :1] if role == "roughness" else pixels  # of colours a note would say so
        write_image(tmp_path / f"wall_{role}.png", shown)
        write_image(tmp_path / "wall" / f"b_{role}.png", shown)
    write_image(tmp_path / "wall" / "b_normal_dx.png", pixels)
    write_image(tmp_path / "x.png", pixels)
    (tmp_path / "x.ezw").write_bytes(encode(pixels))
    write_nets(tmp_path / "n.json", upholster.plane(1, 1))
    (tmp_path / "s.json").write_text('[{"line": [[0, 0, 0], [1, 0, 0]]}]')
    shutil.copy(STREAM, tmp_path / "r.uph")
    for link, file in {
        "x.mtl": "x.png", "x_texture.png": "x.png", "soft.png": "x.png", "code.png": "x.ezw",
        "picture.ezw": "x.png", "stream.png": "r.uph", "page.html": "r.uph", "told.json": "r.uph",
        "sample.json": "x.png",
    }.items():  # fmt: skip
        (tmp_path / link).symlink_to(file)
    (tmp_path / "hard.png").hardlink_to(tmp_path / "x.png")
    (tmp_path / "again").symlink_to(".")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """The command in this process: arguments → status, stdout, stderr."""

    def leave(status: int) -> None:
        raise SystemExit(status)

    def run(arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["upholster", *arguments.split()])
        handler = signal.getsignal(signal.SIGTERM)
        status = -1
        try:
            cli.main()
        except SystemExit as end:
            status = int(str(end.code))
        finally:
            signal.signal(signal.SIGTERM, handler)
        return status, *capsys.readouterr()

    monkeypatch.setattr(os, "_exit", leave)
    return run


def contents(folder: Path) -> dict[str, bytes | str]:
    """Return all names in a folder with what they hold, or where they point."""
    return {
        str(path): os.readlink(path) if path.is_symlink() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


MAPS = "cover wall_albedo.png wall_normal.png wall_roughness.png --on"
REFUSED = [
    # arguments, output, input
    (f"{MAPS} plane --texels 512x512 --tileable -o wall.png", "wall_normal.png", "wall_normal.png"),
    (f"{MAPS} sphere -o atlas:wall.png", "wall_normal.png", "wall_normal.png"),
    ("cover x.png --on plane --texels 64x64 -o x.png", "x.png", "x.png"),
    ("cover x.png --on sphere -o again/x.png", "again/x.png", "x.png"),
    ("cover x.png --on sphere -o soft.png", "soft.png", "x.png"),
    ("cover soft.png --on sphere -o hard.png", "hard.png", "soft.png"),
    ("cover x.png --on sphere -o x.obj", "x.mtl", "x.png"),
    ("cover x_texture.png --on sphere -o new.glb -o x.obj", "x.mtl", "x_texture.png"),
    ("cover wall --on plane --texels 64x64 -o wall/b.png", "wall/b_normal.png", "wall/b_normal.png"),
    ("cover wall --on sphere -o wall/b_normal_dx.png", "wall/b_normal_dx.png", "wall/b_normal_dx.png"),
    ("cover again/wall --on sphere -o wall/b_albedo.png", "wall/b_albedo.png", "again/wall/b_albedo.png"),
    ("cover x.png --on n.json -o new.glb --report n.json", "n.json", "n.json"),
    ("cover x.png --on again/n.json -o new.glb --report ./n.json", "./n.json", "again/n.json"),
    ("cover wall --on plane --direction x.png -o x.png", "x.png", "x.png"),
    ("cover wall --on plane --size-map 1-x.png=1,2 -o x.png", "x.png", "x.png"),
    ("cover wall --on plane --stroke again/s.json --report s.json -o new.glb", "s.json", "again/s.json"),
    ("refine r.uph -o r.uph", "r.uph", "r.uph"),
    ("refine r.uph --bytes 3000 -o new.glb -o again/r.uph", "again/r.uph", "r.uph"),
    ("refine r.uph -o page.html", "page.html", "r.uph"),
    ("refine r.uph -o stream.png", "stream.png", "r.uph"),
    ("levels r.uph -o stream.png", "stream.png", "r.uph"),
    ("levels r.uph --curve -o stream.png", "stream.png", "r.uph"),
    ("encode x.png -o picture.ezw", "picture.ezw", "x.png"),
    ("decode x.ezw -o code.png", "code.png", "x.ezw"),
    ("measure r.uph --json told.json", "told.json", "r.uph"),
    ("measure r.uph --sample x.png --json sample.json", "sample.json", "x.png"),
    ("measure hard.png --sample wall_albedo.png --json sample.json", "sample.json", "hard.png"),
]  # fmt: skip


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize(("arguments", "output", "read"), REFUSED, ids=[case[0] for case in REFUSED])
def test_an_output_that_is_an_input_is_refused(
    folder: Path, command: Any, monkeypatch: pytest.MonkeyPatch, arguments: str, output: str, read: str
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("work began")

    for module, name in (
        (request, "prepare"), (request, "execute"), (output_writer, "paint"), (output_writer,
        "paint_material")
    ):  # fmt: skip
        monkeypatch.setattr(module, name, work)
    before = contents(folder)
    status, out, err = command(arguments)
    assert contents(folder) == before
    assert status == 2
    assert out == ""
    assert (
        err == f"upholster: output {output!r} is the same file as input {read!r}; allowed: any other file\n"
    )


def test_python_refuses_as_the_command_does(folder: Path) -> None:
    before = contents(folder)
    files = {role: folder / f"wall_{role}.png" for role in ROLES}
    for source, target in ((files, "atlas:wall.png"), (folder / "x.png", "soft.png"), (["x.png"], "x.png")):
        with pytest.raises(InputError, match="same file as input"):
            pipeline.cover(source, "sphere", [target])
    with pytest.raises(InputError, match=r"output .*n\.json' is the same file as input 'n\.json'"):
        pipeline.cover("x.png", "n.json", ["new.glb"], report=folder / "n.json")
    with pytest.raises(InputError, match=r"output 'r\.uph' is the same file as input '.*r\.uph'"):
        pipeline.refine(folder / "r.uph", ["r.uph"])
    assert contents(folder) == before


def test_an_earlier_result_is_written_again(folder: Path, command: Any) -> None:
    (folder / "out.png").write_text("an earlier result")
    (folder / "wall" / "out.ezw").write_text("an earlier result, in a folder with inputs")
    status, _, err = command("decode x.ezw -o out.png")
    assert status == 0, err
    status, _, err = command("encode wall/b_albedo.png -o wall/out.ezw")
    assert status == 0, err
    assert (folder / "out.png").read_bytes()[:4] == b"\x89PNG"
    assert (folder / "wall" / "out.ezw").read_bytes()[:5] != b"an ea"


def test_files_of_every_form_of_exemplar(folder: Path) -> None:
    maps = [f"wall/b_{role}.png" for role in (*ROLES, "normal_dx")]
    (folder / "wall" / "notes.txt").write_text("no image")
    assert source_files("x.png") == source_files(Path("x.png")) == source_files(["x.png"]) == ["x.png"]
    assert sorted(source_files("wall")) == sorted(source_files([Path("wall")])) == sorted(maps)
    assert source_files(maps[:2]) == maps[:2]
    assert source_files({"albedo": Path("x.png"), "normal": "y.png"}) == ["x.png", "y.png"]
    assert source_files(Material({"albedo": np.zeros((32, 32, 3), np.uint8)})) == []
    assert source_files([]) == []
    assert source_files("none") == ["none"]
