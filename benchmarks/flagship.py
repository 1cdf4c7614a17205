"""F1: 128² RGB exemplar, the paper's cyclide, 16 charts of 512², method "paper"; and how time grows."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from shutil import which

import numpy as np

import upholster
from benchmarks.measure import EXEMPLAR, Results, median_processor_seconds
from upholster.image import write_image

__all__ = ["flagship", "gmic_seconds", "growth"]


def flagship(results: Results) -> None:
    """Time F1 in processor seconds, painting alone, and G'MIC in the same run."""
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, seed=7, method="paper")

    def cover() -> None:
        upholster.paint(upholster.synthesize(exemplar, surface, seed=7, method="paper"), exemplar)

    whole, peer = median_processor_seconds(cover, runs=11), gmic_seconds()
    theirs = (
        "" if peer is None else f"; a texel by G'MIC {peer / 512**2 * quilt.steps / whole:.0f} times as long"
    )
    results.add(
        "method paper: 128² on 16 charts of 512²",
        whole,
        "s",
        remark=f"the paper: about 5 s by the clock{theirs}",
    )
    painting = median_processor_seconds(lambda: upholster.paint(quilt, exemplar), runs=21)
    results.add("the same, painted again", painting, "s")


def gmic_seconds() -> float | None:
    """Return G'MIC's processor seconds from 128² to 512², without its start; None: it is not installed."""
    if which("gmic") is None:
        print("gmic is not installed: its comparison is left out", file=sys.stderr)
        return None
    with tempfile.TemporaryDirectory() as folder:
        sample = Path(folder) / "sample.png"
        write_image(sample, upholster.read_exemplar(EXEMPLAR, resize=128))

        def run(*command: str) -> None:
            subprocess.run(["gmic", "-v", "-", str(sample), *command, "-o", f"{folder}/out.png"], check=True)

        # Without the time that the program needs to start, read and write.
        making = median_processor_seconds(lambda: run("syntexturize_matchpatch", "512,512"), runs=5)
        return making - median_processor_seconds(run, runs=5)


def growth(results: Results) -> None:
    """Time per texel and peak memory from 1 to 64 Mtexels, each in a process of its own."""
    first: dict[str, float] = {}
    for name, sizes in {
        "more patches, charts of 256²": [(4, 256), (8, 256), (16, 256), (32, 256)],
        "larger charts on 16 patches": [(4, 256), (4, 512), (4, 1024), (4, 2048)],
    }.items():
        for spans, chart in sizes:
            done = subprocess.run(
                [sys.executable, "-m", "benchmarks.flagship", str(spans), str(chart)],
                check=True, capture_output=True, text=True, cwd=Path(__file__).parent.parent,
            )  # fmt: skip
            found = json.loads(done.stdout)
            nanoseconds = found["seconds"] / found["texels"] * 1e9
            base = first.setdefault(name, nanoseconds)
            results.add(
                f"growth, {name}: {found['texels'] / 2**20:.0f} Mtexels",
                nanoseconds,
                "ns/texel",
                aim="within 15 % of 1 Mtexel",
                remark=f"{nanoseconds / base:.2f} of the first",
            )
            limit = 3 * found["bytes"] + 250e6
            results.add(
                f"peak memory, {name}: {found['texels'] / 2**20:.0f} Mtexels",
                found["peak"] / 1e6,
                "MB",
                aim=f"at most {limit / 1e6:.0f}",
                remark="3 times the texels plus 250 MB",
            )


def _measure(spans: int, chart: int) -> None:
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3, spans=(spans, spans))
    _ = surface.shared
    times, size, count = [], 0, 0
    for _ in range(7 if spans * chart <= 4096 else 4):
        start = time.perf_counter()
        texels = upholster.paint(
            upholster.synthesize(exemplar, surface, chart=chart, seed=7, method="paper"), exemplar
        )
        times.append(time.perf_counter() - start)
        size, count = texels.nbytes, texels.count
        del texels
    with open("/proc/self/status", encoding="ascii") as file:
        peak = 1024 * int(next(line for line in file if line.startswith("VmHWM:")).split()[1])
    print(json.dumps({"seconds": float(np.median(times[1:])), "texels": count, "bytes": size, "peak": peak}))


if __name__ == "__main__":
    _measure(int(sys.argv[1]), int(sys.argv[2]))
