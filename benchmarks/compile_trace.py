"""Run ``upholster`` and write what it compiles: ``python -m benchmarks.compile_trace FILE cover …``.

FILE gets a line of JSON for each function that Numba compiles, for kernels and for what is compiled into
them alike. Lines are written as they come, since the command ends its process at once.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

from numba.core import event

import upholster.warm

__all__ = ["Trace"]


class Trace(event.Listener):  # type: ignore[misc]  # numba is untyped
    """Compilations as they nest: processor seconds of each, with and without what it calls."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", encoding="utf-8")
        self._open: list[list[float]] = []  # of what is being compiled: start, seconds of what it calls

    def on_start(self, _event: Any) -> None:
        """Begin a function."""
        self._open.append([time.thread_time(), 0.0])

    def on_end(self, found: Any) -> None:
        """Write a function's line."""
        start, inner = self._open.pop()
        seconds = time.thread_time() - start
        if self._open:
            self._open[-1][1] += seconds
        function = found.data["dispatcher"].py_func
        line = {
            "function": f"{function.__module__.removeprefix('upholster.')}.{function.__name__}",
            "arguments": str(found.data["args"]),
            "kernel": not self._open,
            "cpu": seconds,
            "own_cpu": seconds - inner,
        }
        self._file.write(json.dumps(line) + "\n")
        self._file.flush()


def main() -> None:
    """Trace the command given."""
    event.register("numba:compile", Trace(Path(sys.argv[1])))
    upholster.warm.jobs_for = lambda *_: []  # no helpers: this process compiles everything
    from upholster.cli import main as command

    sys.argv = ["upholster", *sys.argv[2:]]
    command()


if __name__ == "__main__":
    main()
