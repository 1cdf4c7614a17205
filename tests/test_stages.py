"""Stages run once for the same arguments, while something keeps their results."""

import contextlib
import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from upholster.base.errors import CancelledError
from upholster.base.options.sample_options import SampleOptions
from upholster.charts.surface_to_cover import as_covered
from upholster.image.files.source import Sample, read_source
from upholster.image.files.write import write_image
from upholster.runtime.parallel import Stop, cancelled_by, check_cancelled, run_tasks
from upholster.runtime.stages import Stages, file_stage, keeping, stage


def _counted(calls):
    @stage
    def doubled(array, by=2):
        calls.append(by)
        return array * by

    return doubled


def test_nothing_is_kept_by_default():
    calls = []
    doubled = _counted(calls)
    array = np.ones(3)
    assert doubled(array) is not doubled(array)
    assert len(calls) == 2


def test_a_stage_runs_once_for_the_same_arguments():
    calls = []
    doubled, array = _counted(calls), np.ones(3)
    stages = Stages()
    with stages.active():
        first = doubled(array)
        assert doubled(array, by=2) is first
        assert doubled(array, by=2) is first
        assert len(calls) == 1
        assert doubled(array, 2.0) is not first  # another type is another value
        assert doubled(array.copy()) is not first  # arrays count by identity
        assert doubled(doubled(array)) is doubled(first)
    assert [one.name for one in stages.ran] == ["doubled"] * 4
    assert doubled(array) is not first
    with stages.active():
        assert doubled(array) is first


def test_one_call_keeps_what_it_asks_for_twice():
    calls = []
    doubled, array = _counted(calls), np.ones(3)
    with keeping():
        first = doubled(array)
        with keeping():
            assert doubled(array) is first
    assert doubled(array) is not first


def test_the_oldest_results_go_beyond_the_limit():
    calls = []
    doubled = _counted(calls)
    stages = Stages(most_bytes=2500)
    arrays = [np.ones(100) for _ in range(4)]
    for array in (*arrays, arrays[0]):
        with stages.active():
            doubled(array)
    assert stages.bytes <= 2500
    assert len(calls) == 5  # the first had gone
    with stages.active():
        doubled(arrays[0])
        doubled(arrays[3])
    assert len(calls) == 5


def test_what_was_needed_last_stays_even_if_it_is_more():
    calls = []
    doubled = _counted(calls)
    stages = Stages(most_bytes=100)
    arrays = [np.ones(100) for _ in range(4)]
    for _ in range(2):
        with stages.active():
            for array in arrays[:3]:
                doubled(array)
    assert len(calls) == 3
    for _ in range(3):
        with contextlib.suppress(CancelledError), stages.active():
            doubled(arrays[3])
            raise CancelledError("stopped")
    with stages.active():
        for array in arrays[:3]:
            doubled(array)
    assert len(calls) == 4
    assert stages.bytes == 3 * 800


def test_a_stage_that_fails_runs_again():
    calls = []

    @stage
    def failing(n):
        calls.append(n)
        raise ValueError("no")

    with Stages().active():
        for _ in range(2):
            with pytest.raises(ValueError, match="no"):
                failing(1)
    assert calls == [1, 1]


def test_one_thread_waits_for_a_stage_of_another():
    began, calls, found = threading.Event(), [], []

    @stage
    def slow(n):
        calls.append(n)
        began.set()
        time.sleep(0.1)
        return [n]

    stages = Stages()

    def run():
        with stages.active():
            found.append(slow(1))

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert calls == [1]
    assert all(one is found[0] for one in found)


def test_cancelled_work_stops_at_the_next_stage_or_task():
    stop, calls = Stop(), []
    doubled = _counted(calls)
    with cancelled_by(stop):
        doubled(np.ones(1))
        stop.set()
        with pytest.raises(CancelledError):
            doubled(np.ones(1))
        for threads in (1, 2):
            with pytest.raises(CancelledError):
                run_tasks([lambda: calls.append("task")] * 4, threads=threads)
    check_cancelled()
    assert calls == [2]


def test_a_stage_that_reads_files_runs_again_when_they_change(tmp_path):
    file, calls = tmp_path / "file", []
    file.write_text("x")

    @file_stage(lambda found, name: [name])
    def read(name):
        calls.append(name)
        return [Path(name).read_text()]

    with Stages().active():
        first = read(str(file))
        assert read(str(file)) is first
        os.utime(file, (1, 1))
        assert read(str(file)) is not first
        file.write_text("longer")
        assert read(str(file)) == ["longer"]


def test_samples_and_models_are_read_once(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (40, 50, 3), np.uint8)
    write_image(tmp_path / "a.png", pixels)
    model = tmp_path / "m.obj"
    model.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n")
    name = str(tmp_path / "a.png")
    with Stages().active():
        first = read_source(name)
        assert read_source(name) is first
        small = read_source(Sample(name, options=SampleOptions(crop=(0, 0, 32, 32))))
        assert small.shape == (32, 32, 3)
        write_image(tmp_path / "a.png", pixels[:, :40])
        assert read_source(name).shape == (40, 40, 3)
        kept = as_covered(model)
        assert as_covered(str(model)) is kept
        model.write_text(model.read_text() + "v 2 2 2\nf 2 4 5\n")
        assert as_covered(model) is not kept
