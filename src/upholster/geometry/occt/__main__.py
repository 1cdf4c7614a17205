"""Reads a CAD file and writes its contents: ``python -m upholster.geometry.occt FILE RESULT OPTIONS``."""

import json
import os
import pickle
import sys
import time
from pathlib import Path
from typing import Any

from upholster.base.types import Progress
from upholster.geometry.occt.process import NO_ROOM
from upholster.geometry.occt.records import CadRecord

__all__ = ["main"]

_EVERY = 0.1
"""Least number of seconds between two lines of progress."""


def main(file: str, result: str, options: str) -> None:
    """Read a file within limits; write its record, or an error's text. Write progress to stdout meanwhile.

    A line of progress has a stage's name, the count done, and the total. If the reading process has ended,
    writing fails and this process ends.

    Parameters
    ----------
    file, result
        Names of the two files.
    options
        JSON: ``memory`` in bytes, ``seconds``, ``unit`` in millimetres or null, and the options of
        `upholster.geometry.occt.bodies.add_bodies`.
    """
    wanted = json.loads(options)
    _limit(wanted.pop("memory"), wanted.pop("seconds"))
    report = _reporter()
    found: CadRecord | str
    try:
        found = _read(Path(file), wanted, report)
    except MemoryError:
        found = "memory"
    Path(result).write_bytes(pickle.dumps(found, protocol=5))


def _read(file: Path, options: dict[str, Any], report: Progress) -> CadRecord | str:
    try:
        from upholster.geometry.occt.bodies import add_bodies
        from upholster.geometry.occt.shape_reader import UnreadableError, read_shapes
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    except ImportError as error:
        if any(said in str(error) for said in NO_ROOM):
            return "memory"
        return f"it cannot be read: Open CASCADE does not load: {error}".splitlines()[0]
    try:
        record, leaves = read_shapes(file, options.pop("unit"))
        add_bodies(record, leaves, **options, progress=report)
    except UnreadableError as error:
        return f"it {error}"
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    except RuntimeError as error:  # OCP raises C++ exceptions as RuntimeError
        return "memory" if "bad_alloc" in str(error) else f"it cannot be read: {error}".splitlines()[0]
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # A damaged file, for which a library returns something other than it promises.
        return f"it cannot be read: {type(error).__name__}"
    return record


def _reporter() -> Progress:
    """Return a function that writes progress to stdout. Open CASCADE's own output to stdout is discarded."""
    line = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    last = 0.0

    def report(stage: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done < total and now - last < _EVERY:
            return
        last = now
        line.write(f"{stage} {done} {total}\n")
        line.flush()

    return report


def _limit(memory: int, seconds: float) -> None:
    try:
        import resource
    except ModuleNotFoundError:  # no such limits on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # Limits processor time, so that the process ends even if nothing is left to stop it.
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 60,) * 2)


if __name__ == "__main__":
    main(*sys.argv[1:])
