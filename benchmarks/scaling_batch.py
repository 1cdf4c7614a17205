"""A batch of 200 small jobs, 20 surfaces with 10 samples: ``python -m benchmarks.scaling_batch -h``.

Runs `upholster batch` with one single-threaded worker, with two of which one is killed when a quarter is
done, with two, and once more, when there is nothing to do.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from calendar import timegm
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import upholster
from benchmarks.scaling import workers_of
from upholster.image import write_image

_SAMPLES = ("bricks", "granite", "pebbles", "weave")
_SIDE = 96


def main() -> None:
    """Print a line of JSON for each run."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling_batch")
    parser.add_argument("--texels", type=float, default=200e3, help="of each job")
    parser.add_argument("--surfaces", type=int, default=20)
    parser.add_argument("--samples", type=int, default=10)
    parser.add_argument("--runs", nargs="+", default=["one", "killed", "two"])
    asked = parser.parse_args()
    rates: dict[str, float] = {}
    with TemporaryDirectory() as folder:
        jobs = _written(Path(folder), asked)
        for kind in asked.runs:
            found = _run(jobs, 1 if kind == "one" else 2, kill=kind == "killed", again=True)
            rates[kind] = found["jobs a second"]
            print(json.dumps({"run": kind, **found}), flush=True)
        again = _run(jobs, 2, kill=False, again=False)
    print(json.dumps({"run": "nothing to do", "seconds": again["seconds"]}))
    if {"one", "two"} <= rates.keys():
        print(json.dumps({"two workers, times one": round(rates["two"] / rates["one"], 2)}))


def _written(folder: Path, asked: argparse.Namespace) -> Path:
    """Write samples, cut from those of the examples, and the jobs' file."""
    for number in range(asked.samples):
        whole = upholster.read_exemplar(f"examples/{_SAMPLES[number % len(_SAMPLES)]}.png")
        start = 16 * (number // len(_SAMPLES))
        write_image(folder / f"s{number}.png", whole[start : start + _SIDE, start : start + _SIDE])
    surfaces = [f"torus:R=2,r={0.5 + 0.05 * number:.2f}" for number in range(asked.surfaces)]
    lines = [f"texels = {int(asked.texels)}", "sample-size = 1.5", 'output = "out/{n}.glb"', "[[jobs]]"]
    jobs = folder / "jobs.toml"
    jobs.write_text("\n".join([*lines, 'sample = "s*.png"', f"on = {json.dumps(surfaces)}"]) + "\n")
    return jobs


def _run(jobs: Path, workers: int, *, kill: bool, again: bool) -> dict[str, Any]:
    words = [sys.executable, "-m", "upholster", "batch", str(jobs), "-q"]
    words += [f"--workers={workers}", "--threads=1", *(["--again"] if again else [])]
    record = jobs.with_name("batch.json")
    if again:
        record.unlink(missing_ok=True)
    start, left = time.perf_counter(), kill
    process = subprocess.Popen(words)
    while process.poll() is None:
        time.sleep(0.2)
        if left and len(_entries(record)) >= 0.25 * _count(jobs):
            os.kill(workers_of(process.pid)[0], signal.SIGKILL)
            left = False
    took = time.perf_counter() - start
    entries = _entries(record)
    ends = [timegm(time.strptime(each["finished"], "%Y-%m-%dT%H:%M:%SZ")) for each in entries]
    first = min(end - each["seconds"] for end, each in zip(ends, entries, strict=True))
    return {
        "status": process.returncode,
        "done": sum(each["state"] == "done" for each in entries),
        "killed": kill and not left,
        "seconds": round(took, 1),
        # From the first job on, to half a second: what comes before is the same however many there are.
        "jobs a second": round(len(entries) / max(1.0, max(ends) - first), 2),
        "seconds of the jobs": round(sum(each["seconds"] for each in entries), 1),
    }


def _entries(record: Path) -> list[dict[str, Any]]:
    return json.loads(record.read_text())["results"] if record.exists() else []


def _count(jobs: Path) -> int:
    asked = jobs.read_text()
    return len(list(jobs.parent.glob("s*.png"))) * asked.count("torus:")


if __name__ == "__main__":
    main()
