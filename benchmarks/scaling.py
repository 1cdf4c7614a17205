"""One surface on many workers: rate, memory and bytes; ``python -m benchmarks.scaling -h``.

Runs `upholster cover` on the cyclide, a texel for a pixel of the sample, in UDIM tiles, and watches its
processes in /proc (Linux). ``--kill 5`` kills a worker once five parcels are laid.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import upholster
from benchmarks.measure import one_pixel_a_texel

_TICK = os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Run once and print a line of JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling")
    parser.add_argument("--sample", default="examples/pebbles.png")
    parser.add_argument("--texels", type=float, default=64e6)
    parser.add_argument("--tile", type=int, default=4096)
    parser.add_argument("--workers", type=int, default=0, help="0: one thread of one process, without Dask")
    parser.add_argument("--kill", type=int, default=0, metavar="PARCELS")
    parser.add_argument("-o", "--output", help="folder that keeps the tiles")
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        out = Path(asked.output or folder)
        out.mkdir(parents=True, exist_ok=True)
        print(json.dumps(_run(asked, out)))


def _run(asked: argparse.Namespace, out: Path) -> dict[str, object]:
    exemplar = upholster.read_exemplar(asked.sample)
    found = one_pixel_a_texel(upholster.ring_cyclide(6, 2, 3), exemplar, int(asked.texels))
    words = [sys.executable, "-m", "upholster", "cover", asked.sample, "--on", "cyclide", "--quiet"]
    words += [
        f"--texels={int(asked.texels)}",
        f"--sample-size={found['sample_size']}",
        "--direction=around:z",
    ]
    words += [f"--atlas-size={asked.tile}", f"--report={out / 'report.json'}", "-o", f"{out}/x.<UDIM>.png"]
    words += [f"--workers={asked.workers}"] if asked.workers else ["--threads=1"]
    start = time.perf_counter()
    process = subprocess.Popen(words)
    seen, first, left = dict[int, tuple[float, int]](), 0.0, asked.kill
    while process.poll() is None:
        for one in (process.pid, *workers_of(process.pid)):
            seen[one] = used(one) or seen.get(one, (0.0, 0))
        parcels = len(list(out.glob("x.upholster/used-*")))
        first = first or (parcels and time.perf_counter())
        if left and parcels >= left:
            os.kill(workers_of(process.pid)[0], signal.SIGKILL)
            left = 0
        time.sleep(0.2)
    ended = time.perf_counter()
    report = json.loads((out / "report.json").read_text())
    texels = report["counts"]["texels"]
    others = [used for one, used in seen.items() if one != process.pid]
    work = sum(used[0] for used in others) or seen[process.pid][0]
    return {
        "status": process.returncode, "texels": texels, "charts": report["counts"]["charts"],
        "tiles": len(report["written"]), "bytes": sum(report["written"].values()),
        "seconds": round(ended - start, 1), "seconds from the first parcel": round(ended - first, 1),
        "processor seconds of workers": round(work, 1),
        "processor seconds of the client": round(seen[process.pid][0], 1) if others else 0.0,
        "nanoseconds a texel": round(1e9 * work / texels, 1),
        "tasks": report["counts"].get("tasks", 0),
        "scheduler bytes": report["counts"].get("scheduler bytes", 0),
        "most MiB of a worker": max(used[1] for used in others or seen.values()) // 1024,
        "MiB of the client": seen[process.pid][1] // 1024,
    }  # fmt: skip


def workers_of(parent: int) -> list[int]:
    """Return the processes that Dask has started as workers."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            above = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if above == parent and "spawn_main" in (entry / "cmdline").read_text():
                found.append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    return sorted(found)


def used(process: int) -> tuple[float, int] | None:
    """Return processor seconds, and the most kB in memory at once, of a process that still runs."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        status = Path(f"/proc/{process}/status").read_text().splitlines()
        most = next(int(line.split()[1]) for line in status if line.startswith("VmHWM:"))
    except (OSError, StopIteration):
        return None
    return (int(fields[11]) + int(fields[12])) / _TICK, most


if __name__ == "__main__":
    main()
