"""What is done is known by words, version, inputs and outputs; whatever changes makes it undone."""

import json
import os

import pytest

from upholster import FormatError, InputError
from upholster.covering.tasks.jobs import Job
from upholster.covering.tasks.record import Record, state_of

JOB = Job("1: a on torus", ("--on=torus", "--output=x.glb", "--", "a"), ("x.glb",))


def _done(folder):
    for name, data in {"a/map.png": "1", "x.glb": "out", "other": "2"}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(data)
    record = Record(folder / "batch.json", folder / "jobs.toml")
    from upholster import __version__

    record.add(
        JOB,
        {
            "state": "done",
            "version": __version__,
            "inputs": state_of(["a"], folder),
            "outputs": state_of(["x.glb"], folder),
        },
    )
    record.write([JOB])
    return record


def _again(folder):
    return Record(folder / "batch.json", folder / "jobs.toml")


def test_what_is_done_stays_done(tmp_path):
    assert _done(tmp_path).is_done(JOB)
    assert _again(tmp_path).is_done(JOB)
    # Other times alone, as a copy has them, are no change.
    os.utime(tmp_path / "a" / "map.png", (1, 1))
    os.utime(tmp_path / "x.glb", (1, 1))
    assert _again(tmp_path).is_done(JOB)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: (folder / "a" / "map.png").write_text("2"),
        lambda folder: (folder / "a" / "more.png").write_text("1"),
        lambda folder: (folder / "a" / "map.png").unlink(),
        lambda folder: (folder / "x.glb").write_text("longer"),
        lambda folder: (folder / "x.glb").write_text("tuo"),
        lambda folder: (folder / "x.glb").unlink(),
    ],
)
def test_a_change_of_inputs_or_outputs_makes_it_undone(tmp_path, change):
    _done(tmp_path)
    change(tmp_path)
    assert not _again(tmp_path).is_done(JOB)


def test_other_words_and_another_version_make_it_undone(tmp_path, monkeypatch):
    _done(tmp_path)
    assert not _again(tmp_path).is_done(Job(JOB.name, (*JOB.words, "--mirror"), JOB.outputs))
    monkeypatch.setattr("upholster.covering.tasks.record.__version__", "0")
    assert not _again(tmp_path).is_done(JOB)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"jobs": "jobs.toml", "results": [{"words": ["x"]}]}', "\0"]
)
def test_what_is_no_record_is_not_written_over(tmp_path, text):
    (tmp_path / "batch.json").write_text(text)
    with pytest.raises(FormatError, match="not a record"):
        _again(tmp_path)


def test_the_record_of_other_jobs_is_not_written_over(tmp_path):
    _done(tmp_path)
    with pytest.raises(InputError, match=r"jobs\.toml"):
        Record(tmp_path / "batch.json", tmp_path / "others.toml")


def test_jobs_that_are_gone_leave_the_record(tmp_path):
    record = _done(tmp_path)
    record.add(Job("2", ("--on=sphere",), ()), {"state": "failed", "error": "no"})
    record.write([JOB])
    assert [entry["name"] for entry in json.loads((tmp_path / "batch.json").read_text())["results"]] == [
        JOB.name
    ]
