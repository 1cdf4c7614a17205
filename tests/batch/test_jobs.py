"""Files of jobs: what each job becomes, and what is refused, in a line."""

import csv
from pathlib import Path

import pytest

from upholster import FormatError, InputError
from upholster.covering.tasks import jobs
from upholster.covering.tasks.jobs import check_apart, read_jobs

TOML = """
texels = "1M"
mirror = true
rotate = false

[[jobs]]
sample = ["a.jpg", ["b_albedo.png", "b_normal.png"]]
on = ["chair.glb", "torus:R=2"]
output = ["out/{on}-{sample}.glb", "{n}_{seed}.png"]
part = ["Seat", "Leg*"]
[jobs.each]
seed = [1, 2]
"""


def _read(folder: Path, text: str, name: str = "jobs.toml") -> list:
    (folder / name).write_text(text, encoding="utf-8")
    return read_jobs(folder / name)


def test_samples_surfaces_and_values_are_taken_each_with_each(tmp_path):
    jobs = _read(tmp_path, TOML)
    assert len(jobs) == 8
    assert len({job.words for job in jobs}) == 8
    assert jobs[0].words == (
        "--on=chair.glb", "--texels=1M", "--mirror", "--output=out/chair-a.glb", "--output=1_1.png",
        "--part=Seat", "--part=Leg*", "--seed=1", "--", "a.jpg",
    )  # fmt: skip
    assert jobs[7].words[-3:] == ("--", "b_albedo.png", "b_normal.png")
    assert jobs[7].outputs == ("out/torus-R=2-b_albedo.glb", "8_2.png")
    assert [job.name for job in jobs[:2]] == [
        "1: a.jpg + seed 1 on chair.glb",
        "2: a.jpg + seed 2 on chair.glb",
    ]


def test_patterns_are_the_files_that_fit(tmp_path):
    for name in ("b.jpg", "a.jpg", "c.png"):
        (tmp_path / name).touch()
    jobs = _read(tmp_path, '[[jobs]]\nsample = "*.jpg"\non = "torus"\noutput = "{sample}.glb"')
    assert [job.outputs for job in jobs] == [("a.glb",), ("b.glb",)]
    with pytest.raises(InputError, match="no file matches"):
        _read(tmp_path, '[[jobs]]\nsample = "*.webp"\non = "torus"\noutput = "{sample}.glb"')


def test_a_line_of_a_csv_is_a_job(tmp_path):
    with (tmp_path / "jobs.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(
            [
                ["sample", "on", "output", "output", "mirror", "seed"],
                ["a, b.jpg", "torus:R=2,r=1", "{on}.glb", "x.png", "true", ""],
                ["", "", "", "", "", ""],
                ["b.jpg", "sphere", "{n}.glb", "", "false", "7"],
            ]
        )
    first, second = read_jobs(tmp_path / "jobs.csv")
    assert first.words == (
        "--on=torus:R=2,r=1", "--output=torus-R=2,r=1.glb", "--output=x.png", "--mirror", "--", "a, b.jpg",
    )  # fmt: skip
    assert second.words == ("--on=sphere", "--output=2.glb", "--seed=7", "--", "b.jpg")


JOB = '[[jobs]]\nsample = "a.jpg"\non = "torus"\n'


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "no job"),
        ("x = [", "Invalid"),
        ("jobs = 3", r"\[\[jobs\]\]"),
        (JOB, "output is missing"),
        ('[[jobs]]\non = "torus"\noutput = "x.glb"', "sample is missing"),
        ('[[jobs]]\nsample = "a.jpg"\noutput = "x.glb"', "on is missing"),
        (JOB + 'output = "{size}.glb"', r"no \{size\}; allowed: .*\{sample\}"),
        (JOB + 'output = "{sample.__class__}.glb"', "there is no"),
        (JOB + "output = 2020-01-01", "allowed: a text"),
        (JOB + 'output = "x.glb"\nthreads = 2', "--threads of the batch"),
        (JOB + 'output = "x.glb"\n"--texels" = 2', "not an option"),
        (JOB + 'output = "x.glb"\n[jobs.each]\nseed = 1', "each.seed is 1; allowed: a list"),
        (JOB + 'output = "x.glb"\n[jobs.each]\nseed = []', "allowed: a list"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, named):
    with pytest.raises((InputError, FormatError), match=named) as found:
        _read(tmp_path, text)
    assert len(str(found.value).splitlines()) == 1


def test_too_many_jobs_are_refused(tmp_path, monkeypatch):
    assert jobs.MAX_JOBS == 100_000
    monkeypatch.setattr(jobs, "MAX_JOBS", 1000)
    monkeypatch.setattr(jobs, "_job", None)  # refused before the first one
    each = "\n".join(f"{name} = {list(range(60))}" for name in ("seed", "block", "chart", "overlap"))
    with pytest.raises(InputError, match="1,000"):
        _read(tmp_path, f'{JOB}output = "{{n}}.glb"\n[jobs.each]\n{each}')


def test_no_file_is_written_twice_or_read_and_written(tmp_path):
    jobs = _read(tmp_path, JOB + 'output = "x.glb"\n' + JOB + 'output = "./x.glb"')
    with pytest.raises(InputError, match=r"is written by '1: .*' and by '2: "):
        check_apart(jobs, [], tmp_path)
    with pytest.raises(InputError, match="read by a job"):
        check_apart(jobs[:1], ["x.glb"], tmp_path)
    check_apart(jobs[:1], ["a.jpg"], tmp_path)


def test_a_project_needs_no_sample_and_no_surface(tmp_path):
    for name in ("a.upholster.json", "b.upholster.json"):
        (tmp_path / name).touch()
    text = '[[jobs]]\nproject = "*.upholster.json"\noutput = "{project}_{seed}.glb"\neach.seed = [1, 2]'
    jobs = _read(tmp_path, text)
    assert [job.outputs for job in jobs] == [("a_1.glb",), ("a_2.glb",), ("b_1.glb",), ("b_2.glb",)]
    assert jobs[0].words == ("--project=a.upholster.json", "--output=a_1.glb", "--seed=1", "--")
    assert jobs[0].name == "1: seed 1 on a.upholster.json"


@pytest.mark.parametrize("option", ["allow", "save-project"])
def test_a_job_opens_no_folder_and_saves_no_project(tmp_path, option):
    with pytest.raises(InputError, match=f"{option} is not for a job"):
        _read(tmp_path, f'[[jobs]]\nproject = "a.upholster.json"\noutput = "a.glb"\n{option} = "/tmp"')
