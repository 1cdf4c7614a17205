"""Every figure of the paper is drawn by one command from what the project ships."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from upholster.image.files.read import read_image

pytest.importorskip("PIL")

GALLERY = Path(__file__).parent.parent / "docs" / "make_gallery.py"


@pytest.mark.slow(reason="draws every figure")
def test_one_command_draws_every_figure(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, GALLERY, "paper", tmp_path / "figures", "--draft"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    files = sorted((tmp_path / "figures").iterdir())
    assert all(read_image(file).std() > 10 for file in files)
    drawn = {int(number) for file in files for number in re.findall(r"_(\d\d)", file.stem)}
    reported = {int(number) for line in done.stdout.splitlines() if line.startswith("not drawn")
            for number in re.findall(r"\d+", line)}  # fmt: skip
    assert reported <= {11}  # the paper's baseline
    assert drawn | reported == set(range(1, 14))


@pytest.mark.slow(reason="starts processes")
def test_bad_arguments_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for arguments in (["paper"], ["paper", tmp_path / "file"], [tmp_path / "none"]):
        done = subprocess.run(
            [sys.executable, GALLERY, *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
