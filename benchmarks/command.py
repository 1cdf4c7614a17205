"""The command as a whole: warm, on a machine that has never run it, and its help."""

import os
import subprocess
import sys
import tempfile
import time

from benchmarks.measure import EXEMPLAR, Results, median_seconds

__all__ = ["command"]


def command(results: Results) -> None:
    """Time ``upholster cover`` for F1 with GLB and picture, its first run ever, and ``upholster --help``."""
    program = [sys.executable, "-m", "upholster"]
    with tempfile.TemporaryDirectory() as folder:
        cover = [
            *program, "cover", str(EXEMPLAR), "--resize", "128", "--on", "cyclide", "--seed", "7",
            "-o", f"{folder}/ring.glb", "-o", f"{folder}/ring.png",
        ]  # fmt: skip

        def run(*arguments: str, **environment: str) -> str:
            done = subprocess.run(
                arguments, check=True, capture_output=True, text=True, env={**os.environ, **environment}
            )
            return done.stderr

        results.add(
            "command: F1 with GLB and picture, warm",
            median_seconds(lambda: run(*cover), runs=5),
            "s",
            aim="at most 4",
        )
        start = time.perf_counter()
        said = run(*cover, NUMBA_CACHE_DIR=f"{folder}/cache")
        results.add(
            "command: the same, first run ever",
            time.perf_counter() - start,
            "s",
            aim="at most 25",
            remark="says that it compiles" if "compiling" in said else "SAYS NOTHING of compiling",
        )
        results.add(
            "command: --help", median_seconds(lambda: run(*program, "--help"), runs=5), "s", aim="under 0.4"
        )
