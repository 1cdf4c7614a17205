"""Reads a CAD file and writes what it holds: ``python -m upholster.occt FILE RESULT OPTIONS``."""

import json
import pickle
import sys
from pathlib import Path
from typing import Any

from upholster.occt.records import CadRecord

__all__ = ["main"]


def main(file: str, result: str, options: str) -> None:
    """Read a file within a limit of memory; write its record, or an error's text.

    Parameters
    ----------
    file, result
        Names of the two.
    options
        As JSON: ``memory`` in bytes, ``unit`` in millimetres or null, and what
        `upholster.occt.bodies.add_bodies` takes.
    """
    wanted = json.loads(options)
    _limit(wanted.pop("memory"))
    found: CadRecord | str
    try:
        found = _read(Path(file), wanted)
    except MemoryError:
        found = "memory"
    Path(result).write_bytes(pickle.dumps(found, protocol=5))


def _read(file: Path, options: dict[str, Any]) -> CadRecord | str:
    try:
        from upholster.occt.bodies import add_bodies
        from upholster.occt.reading import UnreadableError, read_shapes
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    try:
        record, leaves = read_shapes(file, options.pop("unit"))
        add_bodies(record, leaves, **options)
    except UnreadableError as error:
        return f"it {error}"
    except ModuleNotFoundError as error:
        return f"missing {error.name}"
    except RuntimeError as error:  # what OCP makes of C++ exceptions
        return "memory" if "bad_alloc" in str(error) else f"it can not be read: {error}".splitlines()[0]
    return record


def _limit(memory: int) -> None:
    try:
        import resource
    except ModuleNotFoundError:  # no such limits on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main(*sys.argv[1:])
