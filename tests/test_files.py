import os
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.base.files import outputs, read_bytes, write_bytes
from upholster.charts.tessellation.mesh import Mesh
from upholster.output.export.bare import write_bare_obj, write_bare_ply
from upholster.output.export.glb import write_glb
from upholster.output.export.npz import write_npz
from upholster.output.export.pages import PagedMesh
from upholster.output.export.stl import write_stl
from upholster.output.export.three_mf import write_3mf
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels


def listing(folder: Path) -> Any:
    return sorted(path.name for path in folder.iterdir())


def test_all_appear_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "b.png").write_text("old")
    with outputs([tmp_path / "a.glb", tmp_path / "b.png"]) as files:
        for name in ("a.glb", "b.png", "c.mtl"):
            beside = files.path(tmp_path / name)
            assert beside.parent == tmp_path
            assert beside.suffix == (tmp_path / name).suffix
            beside.write_text(name)
        assert files.path(tmp_path / "a.glb") == files.path(str(tmp_path / "a.glb"))
        assert (tmp_path / "b.png").read_text() == "old"
        assert not (tmp_path / "a.glb").exists()
    assert listing(tmp_path) == ["a.glb", "b.png", "c.mtl"]
    assert (tmp_path / "b.png").read_text() == "b.png"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit, InputError])
def test_none_appears_on_an_error(tmp_path: Path, error: Any) -> None:
    (tmp_path / "b.png").write_text("old")

    def write() -> None:
        with outputs([tmp_path / "a.glb", tmp_path / "b.png"]) as files:
            files.path(tmp_path / "a.glb").write_text("new")
            files.path(tmp_path / "b.png").write_text("new")
            raise error

    with pytest.raises(error):
        write()
    assert listing(tmp_path) == ["b.png"]
    assert (tmp_path / "b.png").read_text() == "old"


def test_what_is_not_written_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "b.png").write_text("old")
    with outputs([tmp_path / "b.png", tmp_path / "c.png"]):
        pass
    assert (tmp_path / "b.png").read_text() == "old"
    assert listing(tmp_path) == ["b.png"]


def refused(*targets: Any, inputs: Any = ()) -> Any:
    ran = False
    with pytest.raises(InputError) as caught, outputs(targets, inputs=inputs):
        ran = True
    assert not ran  # before the work, not after it
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_checked_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    os.mkfifo(tmp_path / "pipe")
    assert "is a directory" in refused(tmp_path / "folder.png")
    assert "is a directory" in refused(str(tmp_path / "folder.png") + "/")
    assert "directory does not exist" in refused(tmp_path / "none" / "x.png")
    assert "File name too long" in refused(tmp_path / f"{'x' * 5000}.png")
    assert "not a regular file" in refused(tmp_path / "pipe")
    assert "not a regular file" in refused("/dev/null")
    assert "given twice" in refused(tmp_path / "x.png", tmp_path / "folder.png" / ".." / "x.png")
    assert "null character" in refused("a\0b")
    assert "cannot be written" in refused("/proc/x.png")
    assert listing(tmp_path) == ["folder.png", "pipe"]


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_directory_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    assert "cannot be written: Permission denied" in refused(tmp_path / "x.png")


def names(folder: Path) -> dict[str, Any]:
    """Other names of the file ``in.png`` in a folder."""
    (folder / "down").mkdir()
    (folder / "in.png").write_text("input")
    (folder / "soft.png").symlink_to("in.png")
    (folder / "hard.png").hardlink_to(folder / "in.png")
    (folder / "linked").symlink_to(folder)
    return {
        "itself": folder / "in.png",
        "dots": f"{folder}/./down/../in.png",
        "symbolic link": folder / "soft.png",
        "hard link": folder / "hard.png",
        "linked folder": folder / "linked" / "in.png",
    }


def test_no_output_is_an_input_by_any_name(tmp_path: Path) -> None:
    known = names(tmp_path)
    before = listing(tmp_path)
    for output in known.values():
        for read in known.values():
            said = refused(tmp_path / "new.png", output, inputs=[tmp_path / "other.png", read])
            assert f"output {os.fspath(output)!r} is the same file as input {os.fspath(read)!r}" in said
    assert listing(tmp_path) == before
    assert (tmp_path / "in.png").read_text() == "input"


def test_inputs_of_a_case_blind_file_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "in.png").write_text("input")
    stat = os.stat

    def blind(path: Any, **options: Any) -> os.stat_result:
        return stat(str(path).replace("IN.PNG", "in.png"), **options)

    monkeypatch.setattr(os, "stat", blind)
    assert "same file as input" in refused(tmp_path / "IN.PNG", inputs=[tmp_path / "in.png"])


def test_targets_known_late_are_checked_too(tmp_path: Path) -> None:
    (tmp_path / "in.png").write_text("input")

    def write(*late: str) -> None:
        with outputs([tmp_path / "a.png"], inputs=[tmp_path / "in.png"]) as files:
            files.path(tmp_path / "a.png").write_text("new")
            files.add(tmp_path / name for name in late)

    def write_unannounced() -> None:
        with outputs(inputs=[tmp_path / "in.png"]) as files:
            files.path(tmp_path / "in.png")

    with pytest.raises(InputError, match="same file as input"):
        write("b.png", "in.png")
    with pytest.raises(InputError, match="given twice"):
        write("a.png", "b.png", "b.png")
    with pytest.raises(InputError, match="same file as input"):
        write_unannounced()
    assert listing(tmp_path) == ["in.png"]


def test_a_new_output_is_no_input_and_missing_inputs_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "in.png").write_text("input")
    inputs = [tmp_path / "in.png", tmp_path / "out.png", "a\0b", tmp_path / "none" / "x.png"]
    with outputs([tmp_path / "out.png"], inputs=inputs) as files:
        files.path(tmp_path / "out.png").write_text("new")
    assert (tmp_path / "out.png").read_text() == "new"


def test_two_outputs_are_not_one_file(tmp_path: Path) -> None:
    known = names(tmp_path)
    itself, hard = known.pop("itself"), known.pop("hard link")
    for other in known.values():
        assert "given twice" in refused(itself, other)
    assert f"output {str(hard)!r} is the same file as output {str(itself)!r}" in refused(itself, hard)


def test_links_stay_links(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "x.png").symlink_to(tmp_path / "real" / "y.png")
    with outputs([tmp_path / "x.png"]) as files:
        files.path(tmp_path / "x.png").write_text("new")
    assert (tmp_path / "x.png").is_symlink()
    assert (tmp_path / "real" / "y.png").read_text() == "new"


def test_errors_of_the_system_name_the_target(tmp_path: Path) -> None:
    with outputs([tmp_path / "x.png"]) as files:
        beside = files.path(tmp_path / "x.png")
    with pytest.raises(InputError, match=r"x\.png' cannot be written: Is a directory"), outputs() as files:
        raise IsADirectoryError(21, "Is a directory", str(files.path(tmp_path / "x.png")))
    with pytest.raises(InputError, match="No space left"), outputs(), open("/dev/full", "w") as full:
        full.write("x" * 100_000)
    with pytest.raises(FileNotFoundError), outputs([tmp_path / "x.png"]):
        (tmp_path / "other").read_text()
    assert not beside.exists()


def written_by(kind: str) -> Callable[[Path | str], object]:
    """A function that writes a file of a kind."""
    corners, triangle = np.arange(9.0).reshape(3, 3), np.array([[0, 1, 2]], np.int32)
    mesh = Mesh(corners, corners, corners[:, :2], np.zeros(3, np.int32), np.zeros((0, 4), np.int32), triangle)
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    texels = Texels((Chart(0, 64, 64),), (pixels,))
    functions: dict[str, Callable[[Path | str], object]] = {
        "obj": lambda path: write_bare_obj(path, corners, triangle, name="x"),
        "ply": lambda path: write_bare_ply(path, corners, triangle),
        "stl": lambda path: write_stl(path, corners, triangle),
        "3mf": lambda path: write_3mf(path, corners, triangle, name="x"),
        "npz": lambda path: write_npz(path, texels),
        "glb": lambda path: write_glb(path, PagedMesh(mesh, corners[:, :2] / 9, pixels)),
        "bytes": lambda path: write_bytes(path, b"x" * 100_000),
    }
    return functions[kind]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no full disk to try")
@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "3mf", "npz", "glb", "bytes"])
def test_a_full_disk_names_the_file_and_the_bytes_that_it_takes(tmp_path: Path, kind: str) -> None:
    write = written_by(kind)
    write(tmp_path / "file")
    size = (tmp_path / "file").stat().st_size
    with pytest.raises(InputError) as raised:
        write("/dev/full")
    expected = f"'/dev/full' cannot be written: No space left on device; it takes {size:,} bytes"
    assert str(raised.value) == expected


def test_a_message_names_the_target_not_the_temporary_file(tmp_path):
    with pytest.raises(InputError) as raised, outputs([tmp_path / "a.png"]) as files:
        raise InputError(f"{str(files.path(tmp_path / 'a.png'))!r} cannot be written: disk full")
    assert str(raised.value) == f"{str(tmp_path / 'a.png')!r} cannot be written: disk full"


@pytest.mark.parametrize("name", ["", "-", 5, None, b"x"])
def test_what_is_no_files_name_is_refused(name):
    with pytest.raises(InputError, match="allowed"):
        read_bytes(name)


def leftover(folder: Path, process: int, age: float) -> Path:
    file = folder / f".upholster-{process}-0123abcd.png"
    file.write_text("half")
    os.utime(file, (time.time() - age,) * 2)
    return file


def test_what_killed_runs_left_is_swept(tmp_path: Path) -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    old = leftover(tmp_path, gone.pid, 2 * 3600)
    kept = [
        leftover(tmp_path, os.getpid(), 2 * 3600),  # its process runs
        leftover(tmp_path, os.getppid(), 2 * 3600),
    ]
    (other := tmp_path / ".upholster-notes.png").write_text("mine")
    with outputs([tmp_path / "a.png"]):
        assert not old.exists()
    assert all(file.exists() for file in [*kept, other])
    fresh = leftover(tmp_path, gone.pid, 60.0)
    with outputs([tmp_path / "a.png"]):
        assert fresh.exists()  # perhaps a process of another machine, on a shared disk


def test_a_killed_run_leaves_the_old_file(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("old")
    code = (
        "import os, signal, sys; from upholster.base.files import outputs\n"
        "with outputs([sys.argv[1]]) as files:\n"
        "    files.path(sys.argv[1]).write_text('new'); os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.png")], check=False)
    assert (tmp_path / "a.png").read_text() == "old"
    (left,) = tmp_path.glob(".upholster-*")
    os.utime(left, (0, 0))
    with outputs([tmp_path / "a.png"]) as files:
        files.path(tmp_path / "a.png").write_text("new")
    assert listing(tmp_path) == ["a.png"]


def test_all_are_on_the_disk_before_one_is_renamed(tmp_path: Path, monkeypatch: Any) -> None:
    reported: list[str] = []
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda file: (reported.append("flush"), fsync(file)))
    monkeypatch.setattr(os, "replace", lambda *names: (reported.append("rename"), replace(*names)))
    with outputs([tmp_path / "a.png", tmp_path / "b.png"]) as files:
        for name in ("a.png", "b.png"):
            files.path(tmp_path / name).write_text(name)
    assert reported == ["flush", "flush", "rename", "rename"]
