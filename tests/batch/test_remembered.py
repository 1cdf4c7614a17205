"""What was read is remembered only where that is asked for, as long as its files stay as they are."""

import os

import numpy as np
import pytest

from upholster.charts.covered import as_covered
from upholster.image import write_image
from upholster.image.source import read_source
from upholster.remembered import recalled, remember


@pytest.fixture
def memory():
    remember(2)
    yield
    remember(0)


def _counted(tmp_path, calls):
    file = tmp_path / "file"
    file.write_text("x")

    def read(key):
        return recalled(key, lambda: calls.append(key) or key, lambda _: [file])

    return file, read


def test_nothing_is_remembered_by_default(tmp_path):
    calls = []
    _, read = _counted(tmp_path, calls)
    assert [read("a"), read("a")] == ["a", "a"]
    assert calls == ["a", "a"]


@pytest.mark.usefixtures("memory")
def test_the_last_ones_are_kept_until_their_files_change(tmp_path):
    calls = []
    file, read = _counted(tmp_path, calls)
    for key in "aabab":
        read(key)
    assert calls == ["a", "b"]
    os.utime(file, (1, 1))
    read("a")
    assert calls == ["a", "b", "a"]
    file.unlink()
    read("a")
    read("c")
    read("d")
    read("b")
    assert calls[3:] == ["a", "c", "d", "b"]


@pytest.mark.usefixtures("memory")
def test_samples_and_models_are_read_once(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (40, 50, 3), np.uint8)
    write_image(tmp_path / "a.png", pixels)
    first = read_source(str(tmp_path / "a.png"))
    assert read_source(str(tmp_path / "a.png")) is first
    write_image(tmp_path / "a.png", pixels[:, :40])
    assert read_source(str(tmp_path / "a.png")).shape == (40, 40, 3)
    model = tmp_path / "m.obj"
    model.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n")
    assert as_covered(model) is as_covered(str(model))
    kept = as_covered(model)
    model.write_text(model.read_text() + "v 2 2 2\nf 2 4 5\n")
    assert as_covered(model) is not kept
