"""Reads a CAD file and writes what it holds: ``python -m upholster.occt FILE RESULT OPTIONS``."""

import json
import os
import pickle
import sys
import time
from pathlib import Path
from typing import Any

from upholster.occt.records import CadRecord
from upholster.types import Progress

__all__ = ["main"]

_EVERY = 0.1
"""Seconds between two lines of progress, at least."""


_NO_ROOM = "bad_alloc", "failed to map", "annot allocate memory"
"""What is said where libraries find no room for themselves."""


def main(file: str, result: str, options: str) -> None:
    """Read a file within limits; write its record, or an error's text, and meanwhile progress to stdout.

    A line of progress is a stage's name, how much of it is done, and of how much. Who reads it may be gone:
    then writing fails, and reading ends.

    Parameters
    ----------
    file, result
        Names of the two.
    options
        As JSON: ``memory`` in bytes, ``seconds``, ``unit`` in millimetres or null, and what
        `upholster.occt.bodies.add_bodies` takes.
    """
    wanted = json.loads(options)
    _limit(wanted.pop("memory"), wanted.pop("seconds"))
    tell = _teller()
    found: CadRecord | str
    try:
        found = _read(Path(file), wanted, tell)
    except MemoryError:
        found = "memory"
    Path(result).write_bytes(pickle.dumps(found, protocol=5))


def _read(file: Path, options: dict[str, Any], tell: Progress) -> CadRecord | str:
    try:
        from upholster.occt.bodies import add_bodies
        from upholster.occt.shape_reading import UnreadableError, read_shapes
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    except ImportError as error:
        if any(said in str(error) for said in _NO_ROOM):
            return "memory"
        return f"it can not be read: Open CASCADE does not load: {error}".splitlines()[0]
    try:
        record, leaves = read_shapes(file, options.pop("unit"))
        add_bodies(record, leaves, **options, progress=tell)
    except UnreadableError as error:
        return f"it {error}"
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    except RuntimeError as error:  # what OCP makes of C++ exceptions
        return "memory" if "bad_alloc" in str(error) else f"it can not be read: {error}".splitlines()[0]
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # A damaged file, of which a library gives something else than what it promises.
        return f"it can not be read: {type(error).__name__}"
    return record


def _teller() -> Progress:
    """Return what writes progress to stdout. What Open CASCADE writes there is not heard."""
    line = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    last = 0.0

    def tell(stage: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done < total and now - last < _EVERY:
            return
        last = now
        line.write(f"{stage} {done} {total}\n")
        line.flush()

    return tell


def _limit(memory: int, seconds: float) -> None:
    try:
        import resource
    except ModuleNotFoundError:  # no such limits on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # Of the processor's time: an end to it even where nobody is left to stop it.
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 60,) * 2)


if __name__ == "__main__":
    main(*sys.argv[1:])
