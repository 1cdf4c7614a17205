"""Every command of the README runs, at few texels: one after the other, in a fresh copy of the project."""

import itertools
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from documented import PATIENCE, run_shown

from upholster.image.files.read import read_image
from upholster.image.files.write import write_image

pytestmark = [
    pytest.mark.slow(reason="runs every command"),
    pytest.mark.skipif(sys.platform == "win32", reason="the commands are written for a POSIX shell"),
]

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
NOT_COPIED = (".git", ".venv*", ".*_cache", "__pycache__", "node_modules", "build", "dist")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def _commands() -> Iterator[str]:
    """Yield what a reader types, in order; of the commands that install, what follows the installation."""
    for language, block in re.findall(r"^```(console|sh)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            if language == "console":
                if line.startswith("$ "):
                    yield line.removeprefix("$ ")
            elif "pip install" not in line:
                yield line
            elif ".venv/bin/upholster" in line:
                yield line[line.index(".venv/bin/upholster") :].removeprefix(".venv/bin/")


def _outputs(command: str) -> list[str]:
    """Return the files that a command says it writes."""
    words = shlex.split(command, comments=True)
    named = [word for option, word in itertools.pairwise(words) if option in ("-o", "--report", ">")]
    return [name.removeprefix("atlas:") for name in named]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the project, with the pictures and nets in it that a reader has of his own."""
    clone = tmp_path_factory.mktemp("readme") / "upholster"
    shutil.copytree(ROOT, clone, ignore=shutil.ignore_patterns(*NOT_COPIED))
    examples = clone / "examples"
    photo = read_image(examples / "granite.png")
    write_image(clone / "photo.jpg", photo)
    write_image(clone / "photo.png", photo)
    shutil.copy(examples / "brick.png", clone)
    for role in ("albedo", "normal", "roughness"):
        (found,) = (examples / "bricks_material").glob(f"*{role}*")
        shutil.copy(found, clone / f"wall_{role}.png")
    (clone / "nets.json").write_text('{"patches": [{"points": [[[0,0,0],[0,0,2]], [[2,0,0],[2,1,2]]]}]}')
    (clone / "streams").mkdir()
    shutil.copy(ROOT / "tests" / "vectors" / "quilt.uph", clone / "streams")
    return clone


@pytest.fixture(autouse=True)
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is started finds the program that is tested, and no browser to open."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "src"))
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)


def test_every_command_runs(clone: Path) -> None:
    commands = list(_commands())
    assert sum("upholster" in command for command in commands) >= 5
    for command in commands:
        before = {name: (clone / name).stat().st_mtime_ns for name in os.listdir(clone)}
        if re.match(r"upholster (serve|view|studio) ", command):
            _serve(command, clone)
            continue
        run_shown(command, clone)
        for name in _outputs(command):
            assert (clone / name).stat().st_size > 0, command
            assert (clone / name).stat().st_mtime_ns != before.get(name), f"{command} left {name} as it was"


def _serve(command: str, clone: Path) -> None:
    """Run a command that serves until Ctrl-C, and look at the page that it names."""
    process = subprocess.Popen(
        [sys.executable, "-m", *shlex.split(command, comments=True)],
        cwd=clone, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        address = re.search(r"http://\S+", line)
        assert address, f"$ {command}\n{line}"
        with urllib.request.urlopen(address[0], timeout=PATIENCE) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        reported, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, f"$ {command}\n{reported}"
    finally:
        process.kill()
        process.communicate()


def test_the_python_runs(clone: Path) -> None:
    (program,) = _blocks("python")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=clone, capture_output=True, text=True, timeout=PATIENCE,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    for name in re.findall(r'write\("([^"]+)"', program):
        assert (clone / name).stat().st_size > 0
