"""Parcels and tiles on Dask's workers: the same as in one process, also after one of them was killed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from upholster.base.errors import InputError
from upholster.covering.tasks.job_runs import cluster_pool
from upholster.pipeline import cover

distributed = pytest.importorskip("distributed")

ROOT = Path(__file__).parent.parent.parent
SAMPLE = ROOT / "examples" / "bricks.png"
SYNTHESIS = {"texels": 150_000, "sample_size": 5, "direction": "around:z"}
NAME = "x.<UDIM>.png"
SMALL_PARCELS = """
from upholster.synthesis.quilt import parcels
parcels.MOST_WHOLE, parcels.SIDE, parcels.BLOCKS = 1000, 100, 4
from upholster.apps.cli import main
raise SystemExit(main())
"""
"""The command, with surfaces cut as in `conftest`."""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with two workers that are threads of this process: it is there at once."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
    ) as cluster:
        yield cluster.scheduler_address


def _tiles(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.glob("*.png")}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The tiles that one process makes."""
    folder = tmp_path_factory.mktemp("alone")
    cover(SAMPLE, "cyclide", [folder / NAME], synthesis=SYNTHESIS, seed=3)
    return _tiles(folder)


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_workers_make_the_same(address: str, alone: dict[str, bytes], tmp_path: Path) -> None:
    # Phases included: bricks repeat.
    report = cover(SAMPLE, "cyclide", [tmp_path / NAME], synthesis=SYNTHESIS, seed=3, scheduler=address)
    assert report.counts["tasks"] > 20  # parcels, each twice
    assert report.counts["scheduler bytes"] > 0
    assert _tiles(tmp_path) == alone


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_meshes_go_over_workers(address: str, tmp_path: Path) -> None:
    wanted = {"texels": 50_000, "sample_size": 0.35}
    for name, more in (("alone", {}), ("workers", {"scheduler": address})):
        (tmp_path / name).mkdir()
        cover(
            ROOT / "examples" / "granite.png", ROOT / "examples" / "chair.glb", tmp_path / name / "x.npz",
            synthesis=wanted, **more,
        )  # fmt: skip
    found, expected = ((tmp_path / name / "x.npz").read_bytes() for name in ("workers", "alone"))
    assert found == expected


def _fails(what: str) -> None:
    raise InputError(what) if what else ValueError("three")


def test_what_fails_on_a_worker_is_reported(address: str) -> None:
    with cluster_pool(scheduler=address, retries=0) as pool:
        pool.submit(("tile", 3), _fails, "'x.1004.png' cannot be written: No space left on device")
        with pytest.raises(InputError, match=r"^'x\.1004\.png' cannot be written: No space left on device$"):
            pool.next()
        pool.submit(("parcel", 4), _fails, "")
        with pytest.raises(InputError, match=r"^parcel 4 could not be done: ValueError: three$"):
            pool.next()


def _older() -> str:
    return "0.0.1"


def test_workers_of_another_version_are_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("upholster.covering.tasks.job_runs._version_here", _older)
    with (
        pytest.raises(InputError, match=r"has upholster 0\.0\.1; allowed: "),
        cluster_pool(scheduler=address),
    ):
        pass


def _workers(parent: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            above = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if above == parent and "spawn_main" in (entry / "cmdline").read_text():
                found.append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    return found


@pytest.mark.slow(reason="starts processes")
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("killed", ["a worker", "the run"])
def test_what_is_killed_goes_on(alone: dict[str, bytes], tmp_path: Path, killed: str) -> None:
    words = ["cover", SAMPLE, "--on", "cyclide", "--texels=150000", "--sample-size=5", "--direction=around:z"]
    words = [sys.executable, "-c", SMALL_PARCELS, *map(str, words), "--seed=3", "-o", NAME, "--workers=2"]

    def start() -> subprocess.Popen[str]:
        return subprocess.Popen(
            words, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        )  # fmt: skip

    process = start()
    while len(list(tmp_path.glob("x.upholster/parcel-*"))) < 4:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    if killed == "a worker":
        os.kill(_workers(process.pid)[0], signal.SIGKILL)
    else:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        process = start()
    _, reported = process.communicate(timeout=600)
    assert process.returncode == 0, reported
    if killed == "the run":
        assert "note: continuing: " in reported
    assert _tiles(tmp_path) == alone
