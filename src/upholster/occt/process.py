"""Reading a CAD file in a process of its own."""

import json
import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from pathlib import Path
from typing import IO

from upholster.errors import InputError
from upholster.occt.records import CadRecord
from upholster.types import Progress

__all__ = ["MEMORY", "SECONDS", "read_cad"]

SECONDS = 600.0
"""How long reading may take."""

MEMORY = 12 << 30
"""Bytes of address space that it may use; of memory that is about a quarter less."""

_EVERY = 0.1
"""Seconds between two looks at how far it is."""

_LIBRARIES = ("OCP", "rhino3dm")


def read_cad(
    path: Path,
    *,
    deviation: float | None = None,
    unique: bool = False,
    unit: float | None = None,
    coarse: bool = False,
    seconds: float | None = None,
    memory: int | None = None,
    progress: Progress | None = None,
) -> CadRecord:
    """Read a CAD file: STEP, IGES and BREP by Open CASCADE, 3DM by rhino3dm as well.

    Parameters
    ----------
    path
        The file, with one of `upholster.formats.CAD_SUFFIXES`.
    deviation
        How far triangles may lie from their faces, in millimetres; by default a two-thousandth of the size.
    unique
        Whether a shape that stands in several places is a body in each.
    unit
        Length of the file's unit in millimetres, where it tells none itself.
    coarse
        Whether few triangles will do, to know what there is.
    seconds, memory
        How long reading may take, and how much memory, in bytes; by default `SECONDS` and `MEMORY`.
    progress
        Called with stages "faces" and "mesh", in the thread that calls this.

    Raises
    ------
    InputError
        If what reads it is not installed; if it can not be read, has no faces, or needs more than the limits.
    """
    seconds, memory = SECONDS if seconds is None else seconds, MEMORY if memory is None else memory
    options = {"unit": unit, "deviation": deviation, "unique": unique, "coarse": coarse}
    options |= {"memory": memory, "seconds": seconds}
    with tempfile.TemporaryDirectory(prefix="upholster-") as folder:
        result = Path(folder, "result")
        command = [sys.executable, "-P", "-m", "upholster.occt", str(path), str(result), json.dumps(options)]
        code = _run(command, seconds, progress)
        found: CadRecord | str | None = pickle.loads(result.read_bytes()) if result.is_file() else None
    if found is None:
        raise InputError(f"Open CASCADE crashes on it (status {code}): it can not be read")
    if isinstance(found, str):
        raise _refused(found, memory)
    if not any(body.faces for body in found.bodies):
        raise InputError("it has no surfaces; allowed: a model with faces")
    return found


def _run(command: list[str], seconds: float, progress: Progress | None) -> int:
    """Run the process to its end, or until the time is over; return its status."""
    process: subprocess.Popen[str] | None = None
    heard: deque[str] = deque()
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_environment(),
            text=True,
        )
        assert process.stdout is not None
        listener = threading.Thread(target=_hear, args=(process.stdout, heard), daemon=True)
        listener.start()
        end = time.monotonic() + seconds
        code = None
        while code is None:
            code = _waited(process, min(_EVERY, end - time.monotonic()))
            if code is None and time.monotonic() >= end:
                raise InputError(f"takes more than {seconds:g} s to read; allowed: as much")
            if code is not None:
                listener.join()
            _tell(heard, progress)
        return code
    finally:  # also when the user stops the program
        if process is not None:
            process.kill()
            process.wait()


def _waited(process: "subprocess.Popen[str]", seconds: float) -> int | None:
    """Wait for a process to end; return its status, None if it still runs."""
    try:
        return process.wait(max(0.0, seconds))
    except subprocess.TimeoutExpired:
        return None


def _hear(lines: IO[str], heard: deque[str]) -> None:
    with lines:
        heard.extend(lines)


def _tell(heard: deque[str], progress: Progress | None) -> None:
    while heard:
        stage, done, total = heard.popleft().split()
        if progress is not None:
            progress(stage, int(done), int(total))


def _refused(text: str, memory: int) -> InputError:
    if text == "memory":
        return InputError(f"it needs more than {memory / 2**30:.3g} GiB of memory to read; allowed: as much")
    missing, _, name = text.partition(" ")
    if missing == "missing" and name.partition(".")[0] in _LIBRARIES:
        return InputError(f"reading it needs {name}; install it: pip install 'upholster[cad]'")
    return InputError(text)


def _environment() -> dict[str, str]:
    """Return the environment, in which the process finds this package wherever it lies."""
    root = str(Path(__file__).parents[2])
    known = os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": root if not known else f"{root}{os.pathsep}{known}"}
