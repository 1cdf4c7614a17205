"""Kernels compiled ahead of time: their table, their files, and the processes that compile them."""

import json
import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numba
import pytest
from benchmarks.kernel_table import USES

from upholster.runtime.kernel_cache import _KEPT, KernelCache, _imported, _report_damage
from upholster.runtime.signatures import read_type, type_as_json
from upholster.runtime.warm import TABLE, Compiler, jobs_for

ROOT = Path(__file__).parent.parent


def test_every_type_in_the_table_is_read_as_it_was_written():
    for row in json.loads(TABLE.read_text())["kernels"]:
        for written in row["arguments"]:
            assert type_as_json(read_type(written)) == written


def test_a_kernel_comes_after_what_it_is_made_of():
    jobs = jobs_for()
    assert all(jobs.index(other) < n for n, job in enumerate(jobs) for other in job.needs)
    assert all(set(job.needs) <= set(some) for some in [jobs_for(["quilt model"])] for job in some)


def test_sources_are_followed_through_packages_and_modules():
    found = _imported(ROOT / "src/upholster/runtime/warm.py") | _imported(
        ROOT / "src/upholster/apps/cli/__init__.py"
    )
    names = {str(path.relative_to(ROOT / "src/upholster")) for path in found}
    assert {"runtime/parallel.py", "runtime/signatures.py", "apps/cli/codec.py", "base/errors.py"} <= names


def _kernel(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))

    def half(x):
        return x / 2

    compiled = numba.njit(half)
    KernelCache.attach(compiled)
    return compiled


def test_each_signature_has_a_file_of_its_own_whoever_writes_it(tmp_path, monkeypatch):
    for kind in (numba.int64, numba.float64):  # two processes that know nothing of each other
        _kernel(tmp_path, monkeypatch).compile((kind,))
    assert len(list(tmp_path.rglob("*.kernel"))) == 2
    third = _kernel(tmp_path, monkeypatch)
    third.compile((numba.float64,))
    assert sum(third.stats.cache_hits.values()) == 1
    assert third(3.0) == 1.5


def test_code_that_is_there_is_loaded_without_what_would_compile_it(tmp_path, monkeypatch):
    _kernel(tmp_path, monkeypatch).compile((numba.int64,))
    again = _kernel(tmp_path, monkeypatch)
    monkeypatch.setattr(type(again.targetctx), "refresh", lambda _: pytest.fail("everything was loaded"))
    again.compile((numba.int64,))
    assert sum(again.stats.cache_hits.values()) == 1
    assert again(3) == 1.5


def test_versions_side_by_side_keep_their_code_and_old_ones_go(tmp_path, monkeypatch):
    def stamps():
        return {path.name.split(".")[-3] for path in tmp_path.rglob("*.kernel")}

    def use(stamp):
        monkeypatch.setattr("upholster.runtime.kernel_cache._stamp", lambda *_: stamp)
        again = _kernel(tmp_path, monkeypatch)
        again.compile((numba.int64,))
        for path in tmp_path.rglob(f"*.{stamp}.*"):  # a clock may stand still for a test
            os.utime(path, (len(used), len(used)))
        used.append(stamp)
        return sum(again.stats.cache_misses.values())

    used = []
    assert [use(stamp) for stamp in ("one", "two", "one", "two")] == [1, 1, 0, 0]
    for n in range(_KEPT):
        use(f"later{n}")
    assert len(stamps()) == _KEPT
    assert not stamps() & {"one"}


@pytest.mark.slow(reason="compiles kernels in processes")
@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "text"])
def test_damaged_code_is_deleted_compiled_anew_and_reported_once(tmp_path, monkeypatch, damage):
    _report_damage.cache_clear()
    kinds = (numba.int64, numba.float64)
    for kind in kinds:
        _kernel(tmp_path, monkeypatch).compile((kind,))
    files = list(tmp_path.rglob("*.kernel"))
    whole = files[0].read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for file in files:
        file.write_bytes(
            {"empty": b"", "cut": whole[:middle], "flipped": flipped, "text": b"no code"}[damage]
        )
    again = _kernel(tmp_path, monkeypatch)
    with warnings.catch_warnings(record=True) as reported:
        warnings.simplefilter("always")
        for kind in kinds:
            again.compile((kind,))
    assert ["damaged; they are compiled again" in str(one.message) for one in reported] == [True]
    assert again(3) == 1.5
    last = _kernel(tmp_path, monkeypatch)  # mended
    for kind in kinds:
        last.compile((kind,))
    assert sum(last.stats.cache_hits.values()) == 2


def test_a_folder_that_is_named_serves_copies_of_the_program(tmp_path, monkeypatch):
    kernel = _kernel(tmp_path, monkeypatch)
    kernel.compile((numba.int64,))
    assert [path.parent for path in tmp_path.rglob("*.kernel")] == [tmp_path]


def test_kernels_work_where_no_folder_can_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.caching.CacheImpl._locator_classes", [])
    compiled = _kernel(tmp_path, monkeypatch)
    assert compiled(3.0) == 1.5
    assert not isinstance(compiled._cache, KernelCache)


def _run(code, tmp_path):
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=900,
    )


PICK = """
from upholster.runtime.warm import *
jobs = sorted(jobs_for(), key=lambda job: job.seconds)
jobs = [job for job in jobs if not job.needs][:2]
assert len(missing(jobs)) == 2
"""


@pytest.mark.slow(reason="compiles kernels in processes")
def test_helpers_compile_what_the_command_then_loads(tmp_path):
    code = (
        PICK
        + """
import upholster.runtime.warm
from numba.core import event
upholster.runtime.warm.jobs_for = lambda uses: jobs
with event.install_recorder("numba:compile") as compiled, compiling(["any"]) as compiler:
    assert compiler.total == 2
    jobs[1].dispatcher().compile(jobs[1].types())  # waits
    compiler.wait()
    assert compiler.done == 2 and not compiler.running
assert not compiled.buffer
assert not missing(jobs)
"""
    )
    done = _run(code, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow(reason="compiles kernels in processes")
def test_kernels_are_compiled_for_a_process_without_numba(tmp_path):
    code = """
import os, sys, time
from pathlib import Path
from upholster.runtime.warm import compiling_apart
with compiling_apart(["info model"], "compiling {} kernels"):
    while not list(Path(os.environ["NUMBA_CACHE_DIR"]).glob("*.kernel")):
        time.sleep(0.1)
assert "numba" not in sys.modules
"""
    done = _run(code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("compiling ")


@pytest.mark.slow(reason="compiles kernels in processes")
def test_a_helper_that_dies_costs_time_and_no_more(tmp_path):
    code = (
        PICK
        + """
import upholster.runtime.warm
upholster.runtime.warm.jobs_for = lambda uses: jobs
with compiling(["any"]) as compiler:
    for helper in compiler._helpers:
        helper.kill()
    jobs[1].dispatcher().compile(jobs[1].types())
    compiler.wait()
    assert not compiler.running
"""
    )
    done = _run(code, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow(reason="compiles kernels in processes")
def test_nobody_waits_for_a_kernel_that_can_not_be_compiled(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path))
    jobs = [job for job in jobs_for() if job.needs][:1]
    broken = jobs[0].needs[0]
    broken.arguments, broken.needs = broken.arguments[:-1], []  # a table of another version
    jobs[0].needs = [broken]
    compiler = Compiler([broken, jobs[0]], 2)
    try:
        compiler.wait()  # comes back
        assert not any(job.done for job in jobs)
    finally:
        compiler.close()


def test_helpers_end_with_the_command_even_if_it_is_killed(tmp_path):
    code = (
        PICK
        + """
import os, signal, sys
compiler = Compiler(jobs_for(), 2)
print(*[helper.pid for helper in compiler._helpers], flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
    )
    done = _run(code, tmp_path)
    for pid in done.stdout.split():
        _wait_for_end(int(pid))


def _wait_for_end(pid):
    for _ in range(3000):
        state = Path(f"/proc/{pid}/stat")
        if not state.exists() or state.read_text().split()[2] == "Z":
            return
        time.sleep(0.1)
    pytest.fail(f"helper {pid} lives on")


def _together(uses):
    """Return covers that differ in what they write as one each: they need the same kernels."""
    found, names = {}, {}
    for use, arguments in uses.items():
        head, _, outputs = arguments.partition(" -o ")
        if head.startswith("cover ") and head in names:
            found[names[head]] += f" -o {outputs}"
        else:
            names[head] = use
            found[use] = arguments
    return found


EVERY_USE = """
import json, sys
from pathlib import Path
from benchmarks.kernel_table import begin_record
from upholster.apps.cli import run_words
begin_record(Path("record.jsonl"))
for arguments in json.load(sys.stdin):
    run_words(arguments)
"""
"""Runs commands, one after the other: each kernel is loaded, or compiled, and written down once."""


@pytest.mark.slow(reason="runs every use of the program")
def test_the_table_has_what_every_use_needs(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", EVERY_USE],
        input=json.dumps([arguments.split() for arguments in _together(USES).values()]),
        cwd=tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)]),
            "UPHOLSTER_CACHE": str(tmp_path / "cache"),
        },
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    lines = map(json.loads, (tmp_path / "record.jsonl").read_text().splitlines())
    needed = [line["used"] for line in lines if "used" in line]
    table = [[row["kernel"], row["arguments"]] for row in json.loads(TABLE.read_text())["kernels"]]
    assert len(needed) > 100
    assert not {name for name, types in needed if [name, types] not in table}, (
        "run python -m benchmarks.kernel_table"
    )
