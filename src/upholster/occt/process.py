"""Reading a CAD file in a separate process."""

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
"""Default time limit for reading."""

MEMORY = 12 << 30
"""Default limit of its address space, in bytes; the memory used is about a quarter less."""

_EVERY = 0.1
"""Seconds between two checks of progress."""

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
    """Read a CAD file: STEP, IGES and BREP with Open CASCADE, 3DM with rhino3dm in addition.

    Parameters
    ----------
    path
        The file, with one of `upholster.formats.CAD_SUFFIXES`.
    deviation
        Greatest distance of triangles from their faces, in millimetres; by default a two-thousandth of the
        size.
    unique
        Whether each placement of a shape becomes a separate body.
    unit
        Length of the file's unit in millimetres, if the file states none.
    coarse
        Whether coarse triangles suffice, to find out what the file contains.
    seconds, memory
        Limits of time in seconds and memory in bytes; by default `SECONDS` and `MEMORY`.
    progress
        Called with stages "faces" and "mesh", in the calling thread.

    Raises
    ------
    InputError
        If a package for reading is not installed; if the file cannot be read, has no faces, or needs more
        than the limits.
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
        raise InputError(f"Open CASCADE crashes on it (status {code}): it cannot be read")
    if isinstance(found, str):
        raise _refused(found, memory)
    if not any(body.faces for body in found.bodies):
        raise InputError("it has no surfaces; allowed: a model with faces")
    return found


def _run(command: list[str], seconds: float, progress: Progress | None) -> int:
    """Run the process to its end, or until the time is up; return its status."""
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
                raise InputError(f"it takes more than {seconds:g} s to read; allowed: up to that")
            if code is not None:
                listener.join()
            _report(heard, progress)
        return code
    finally:  # also when the user stops the program
        if process is not None:
            process.kill()
            process.wait()


def _waited(process: "subprocess.Popen[str]", seconds: float) -> int | None:
    """Wait for a process to end; return its status, None if it is still running."""
    try:
        return process.wait(max(0.0, seconds))
    except subprocess.TimeoutExpired:
        return None


def _hear(lines: IO[str], heard: deque[str]) -> None:
    with lines:
        heard.extend(lines)


def _report(heard: deque[str], progress: Progress | None) -> None:
    while heard:
        stage, done, total = heard.popleft().split()
        if progress is not None:
            progress(stage, int(done), int(total))


def _refused(text: str, memory: int) -> InputError:
    if text == "memory":
        return InputError(
            f"it needs more than {memory / 2**30:.3g} GiB of memory to read; allowed: up to that"
        )
    missing, _, name = text.partition(" ")
    if missing == "missing" and name.partition(".")[0] in _LIBRARIES:
        return InputError(f"reading it needs {name}; install it: pip install 'upholster[cad]'")
    return InputError(text)


def _environment() -> dict[str, str]:
    """Return the environment, extended so that the process finds this package."""
    root = str(Path(__file__).parents[2])
    known = os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": root if not known else f"{root}{os.pathsep}{known}"}
