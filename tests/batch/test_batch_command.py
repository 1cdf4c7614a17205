"""`upholster batch` on Dask's workers: what is done, what fails, what a second run does."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import assert_one_line, run_cli

from upholster import Project, save_project
from upholster.image.files.read import read_image
from upholster.pipeline import cover

distributed = pytest.importorskip("distributed")

ROOT = Path(__file__).parent.parent.parent
SAMPLE = ROOT / "examples" / "weave.png"
ALLOWED = ("--allow", str(SAMPLE.parent))


def _batch(folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    # A process of its own, as users start it: Dask's workers are its children.
    return subprocess.run(
        [sys.executable, "-m", "upholster", "batch", "jobs.toml", "--workers", "1", *ALLOWED, *more],
        cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
    )  # fmt: skip


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """A scheduler whose worker is a thread of this process: it is there at once."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster.scheduler_address


@pytest.mark.slow(reason="covers several models by commands")
def test_jobs_are_done_once_and_what_fails_is_reported(tmp_path: Path, scheduler: str) -> None:
    (tmp_path / "jobs.toml").write_text(
        f'texels = "96x96"\n[[jobs]]\nsample = ["{SAMPLE}", "missing.png"]\non = "plane"\n'
        'output = "out/{sample}.png"\n'
    )
    done = _batch(tmp_path, "--sheet", "sheet.png")
    assert done.returncode == 1, done.stderr
    assert "failed: 2: missing.png on plane: 'missing.png' does not exist" in done.stderr
    cover(str(SAMPLE), "plane", [tmp_path / "alone.png"], synthesis={"texels": (96, 96)})
    assert (tmp_path / "out/weave.png").read_bytes() == (tmp_path / "alone.png").read_bytes()
    assert read_image(tmp_path / "sheet.png").std() > 10
    first, second = json.loads((tmp_path / "batch.json").read_text())["results"]
    assert (first["state"], first["texels"], second["state"]) == ("done", 96 * 96, "failed")
    assert str(SAMPLE) in first["inputs"]

    # The sample is there now: only its job is done.
    (tmp_path / "missing.png").write_bytes(SAMPLE.read_bytes())
    before = (tmp_path / "out/weave.png").stat().st_mtime_ns
    words = ("batch", "jobs.toml", *ALLOWED, "--scheduler")
    done = run_cli(*words, scheduler, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "failed: 2" not in done.stderr
    assert "1 of 2 jobs are done already" in done.stdout
    assert (tmp_path / "out/weave.png").stat().st_mtime_ns == before
    assert (tmp_path / "out/missing.png").read_bytes() == (tmp_path / "out/weave.png").read_bytes()
    # Nothing is left to do, and no worker is started for it.
    done = run_cli(*words, "tcp://127.0.0.1:9", cwd=tmp_path)
    assert done.returncode == 0
    assert "2 of 2 jobs are done already" in done.stdout


def test_a_file_of_jobs_reaches_nothing_outside_its_folder(tmp_path: Path, scheduler: str) -> None:
    folder, other = tmp_path / "jobs", tmp_path / "other"
    for made in (folder, other):
        made.mkdir()
    (other / "secret.png").write_bytes(SAMPLE.read_bytes())
    (folder / "link.png").symlink_to(other / "secret.png")
    (folder / "own.png").write_bytes(SAMPLE.read_bytes())
    for sample, output in (
        ("../other/secret.png", "a.png"),
        (str(other / "secret.png"), "a.png"),
        ("link.png", "a.png"),
        ("own.png", "directions:../other/a.png"),
        ("own.png", "atlas:../other/a.png"),
        ("own.png", "../other/a.png"),
    ):
        (folder / "jobs.toml").write_text(
            f'texels = "64x64"\n[[jobs]]\nsample = "{sample}"\non = "plane"\noutput = "{output}"\n'
        )
        done = run_cli("batch", folder / "jobs.toml", "--workers", "1", *ALLOWED)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
        assert "it refers to" in done.stderr
        assert "--allow DIR" in done.stderr
        assert len(list(other.iterdir())) == 1
    allowed = ("--allow", other, "--scheduler", scheduler)
    done = run_cli("batch", "jobs.toml", *ALLOWED, *allowed, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (other / "a.png").exists()


@pytest.mark.slow(reason="covers several models by commands")
def test_jobs_take_projects(tmp_path: Path, scheduler: str) -> None:
    project = Project("plane", str(SAMPLE), synthesis={"texels": (64, 64)}, seed=3)
    save_project(project, tmp_path / "flat.upholster.json")
    jobs = tmp_path / "jobs.toml"
    jobs.write_text(
        '[[jobs]]\nproject = "*.upholster.json"\noutput = "{project}_{seed}.png"\neach.seed = [3, 4]\n'
    )
    words = ("batch", "jobs.toml", "--scheduler", scheduler)
    done = run_cli(*words, *ALLOWED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    project.cover([str(tmp_path / "alone.png")])
    assert (tmp_path / "flat_3.png").read_bytes() == (tmp_path / "alone.png").read_bytes()
    assert (tmp_path / "flat_4.png").read_bytes() != (tmp_path / "alone.png").read_bytes()
    first = json.loads((tmp_path / "batch.json").read_text())["results"][0]
    assert set(first["inputs"]) == {"flat.upholster.json", "weave.png"}
    # A project may be a stranger's, too.
    reported = json.loads((tmp_path / "flat.upholster.json").read_text())
    reported["sample"]["source"] = str(SAMPLE)
    (tmp_path / "flat.upholster.json").write_text(json.dumps(reported))
    assert_one_line(run_cli(*words, cwd=tmp_path), "it refers to")
    assert run_cli(*words, *ALLOWED, cwd=tmp_path).returncode == 0  # the sample's folder is allowed


def _begun(folder: Path) -> subprocess.Popen[str]:
    """Start a batch of six jobs, and wait until at least one of them is done."""
    (folder / "jobs.toml").write_text(
        f'texels = "256x256"\nsample = "{SAMPLE}"\non = "plane"\noutput = "{{seed}}.png"\n'
        "[[jobs]]\n[jobs.each]\nseed = [1, 2, 3, 4, 5, 6]\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "upholster", "batch", "jobs.toml", "--workers", "1", *ALLOWED],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
    )  # fmt: skip
    while not (folder / "1.png").exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    return process


def _said(reported: str) -> list[str]:
    """Return the lines that are no progress; a busy machine has some of these."""
    return [line for line in reported.splitlines() if "0 failed" not in line]


def _workers(process: subprocess.Popen[str]) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == process.pid and "spawn_main" in (entry / "cmdline").read_text():
                found.append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    return found


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_jobs_of_a_worker_that_dies_are_done_by_another(tmp_path: Path) -> None:
    process = _begun(tmp_path)
    for worker in _workers(process):
        os.kill(worker, signal.SIGKILL)
    reported = process.communicate(timeout=600)
    assert process.returncode == 0, reported
    assert {path.name for path in tmp_path.glob("*.png")} == {f"{seed}.png" for seed in range(1, 7)}


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_what_is_done_when_it_is_stopped_stays_done(tmp_path: Path) -> None:
    process = _begun(tmp_path)
    workers = _workers(process)
    os.killpg(process.pid, signal.SIGINT)
    _, reported = process.communicate(timeout=600)
    assert process.returncode in (0, 130)  # 0: all were done before the signal came
    if process.returncode == 130:
        assert "jobs are done, and stay done" in reported
        assert len(_said(reported)) == 1, reported
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        time.sleep(0.05)
    assert not list(tmp_path.glob(".upholster*"))
    results = json.loads((tmp_path / "batch.json").read_text())["results"]
    done = _batch(tmp_path)
    assert (done.returncode, _said(done.stderr)) == (0, []), done.stderr
    assert f"{len(results)} of 6 jobs are done already" in done.stdout or len(results) in (0, 6)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--workers", "0"], "workers is 0"),
        (["--workers", "1", "--scheduler", "tcp://a:1"], "workers and scheduler are both given"),
        (["--threads", "-1"], "threads is -1"),
        (["--retries", "21"], "retries is 21"),
        (["--sheet", "sheet.txt"], "sheet 'sheet.txt'"),
        (["--sheet", "a.png"], "same file"),
        (["--output", "jobs.toml"], "not a record"),
    ],
)
def test_bad_options_are_one_line(tmp_path: Path, options: list[str], named: str) -> None:
    (tmp_path / "jobs.toml").write_text('[[jobs]]\nsample = "a.png"\non = "torus"\noutput = "x.glb"\n')
    (tmp_path / "a.png").touch()
    before = sorted(tmp_path.iterdir())
    assert_one_line(run_cli("batch", "jobs.toml", *options, cwd=tmp_path), named)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ('samplesize = "3cm"', "samplesize"),
        ('texels = "many"', "texels is 'many'"),
        ("seed = 1.5", "seed"),
        ('method = "paint"', "'paint'"),
        ('report = "x.glb"', "x.glb"),
    ],
)
def test_bad_jobs_are_one_line_before_any_work(tmp_path: Path, line: str, named: str) -> None:
    (tmp_path / "jobs.toml").write_text(
        f'{line}\n[[jobs]]\nsample = "a.png"\non = "torus"\noutput = "x.glb"\n'
    )
    assert_one_line(run_cli("batch", "jobs.toml", cwd=tmp_path), named)
    assert not (tmp_path / "batch.json").exists()


def test_a_scheduler_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "jobs.toml").write_text('[[jobs]]\nsample = "a.png"\non = "torus"\noutput = "x.glb"\n')
    done = run_cli("batch", "jobs.toml", "--scheduler", "nonsense://", cwd=tmp_path)
    assert_one_line(done, "scheduler 'nonsense://' does not answer")
