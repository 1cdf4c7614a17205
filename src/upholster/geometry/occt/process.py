"""Reading a CAD file in a separate process."""

import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from pathlib import Path
from typing import IO

from upholster.base.errors import InputError
from upholster.geometry.occt.records import CadRecord
from upholster.runtime.parallel import report_progress

__all__ = ["MEMORY", "NO_ROOM", "SECONDS", "read_cad"]

SECONDS = 600.0
"""Default time limit for reading."""

MEMORY = 12 << 30
"""Default limit of its address space, in bytes; the memory used is about a quarter less."""

_EVERY = 0.1
"""Seconds between two checks of progress."""

NO_ROOM = "bad_alloc", "failed to map", "annot allocate memory"
"""Parts of error messages from libraries that could not allocate memory for themselves."""

_WINDOWS_FAULT = 0xC0000000
"""Least status of a process that Windows has ended for a fault."""

_TO_END = 2.0
"""Maximum number of seconds that a killed process may take to end."""

_KEPT = 20
"""Number of lines kept of the process's errors."""

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
) -> CadRecord:
    """Read a CAD file: STEP, IGES and BREP with Open CASCADE, 3DM with rhino3dm in addition.

    Progress has the stages "faces" and "mesh".

    Parameters
    ----------
    path
        The file, with one of `upholster.base.formats.CAD_SUFFIXES`.
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
        command = [
            sys.executable,
            "-P",
            "-m",
            "upholster.geometry.occt",
            os.path.abspath(path),
            str(result),
            json.dumps(options),
        ]
        code, said = _run(command, seconds)
        found: CadRecord | str | None = pickle.loads(result.read_bytes()) if result.is_file() else None
    if found is None:
        raise _refused(_ended(code, said), memory)
    if isinstance(found, str):
        raise _refused(found, memory)
    if not any(body.faces for body in found.bodies):
        raise InputError("it has no surfaces; allowed: a model with faces")
    return found


def _run(command: list[str], seconds: float) -> tuple[int, str]:
    """Run the process to its end, or until the time is up; return its status and the end of its errors."""
    process: subprocess.Popen[str] | None = None
    heard: deque[str] = deque()
    errors: deque[str] = deque(maxlen=_KEPT)
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=_environment(),
            text=True,
            errors="replace",
        )
        assert process.stdout is not None
        assert process.stderr is not None
        pipes = (process.stdout, heard), (process.stderr, errors)
        listeners = [threading.Thread(target=_hear, args=pipe, daemon=True) for pipe in pipes]
        for listener in listeners:
            listener.start()
        end = time.monotonic() + seconds
        code = None
        while code is None:
            code = _waited(process, min(_EVERY, end - time.monotonic()))
            if code is None and time.monotonic() >= end:
                raise InputError(f"it takes more than {seconds:g} s to read; allowed: up to that")
            if code is not None:
                for listener in listeners:
                    listener.join()
            _report(heard)
        return code, "".join(errors).strip()
    finally:  # also when the user stops the program
        if process is not None:
            process.kill()
            # Not without a limit: stopped in the middle of `wait`, Python can leave its lock held.
            _waited(process, _TO_END)


def _waited(process: "subprocess.Popen[str]", seconds: float) -> int | None:
    """Wait for a process to end; return its status, None if it is still running."""
    try:
        return process.wait(max(0.0, seconds))
    except subprocess.TimeoutExpired:
        return None


def _hear(lines: IO[str], heard: deque[str]) -> None:
    with lines:
        heard.extend(lines)


def _report(heard: deque[str]) -> None:
    while heard:
        stage, done, total = heard.popleft().split()
        report_progress(stage, int(done), int(total))


def _ended(code: int, said: str) -> str:
    """Return why a process ended without a result: from its status, and the end of its errors."""
    if any(words in said for words in NO_ROOM):
        return "memory"
    name = next((one.name for one in signal.Signals if one == -code), "")
    if name == "SIGKILL":
        return "it cannot be read: the system ended the process that reads it, as it does if memory is short"
    if name == "SIGXCPU":
        return "it cannot be read: it takes too much processor time"
    if code < 0 or code >= _WINDOWS_FAULT:
        return f"Open CASCADE crashes on it ({name or f'status {code}'}): it cannot be read"
    last = said.splitlines()[-1] if said else f"status {code}"
    return f"it cannot be read: the process that reads it fails: {last}"


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
    root = str(Path(__file__).parents[3])
    known = os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": root if not known else f"{root}{os.pathsep}{known}"}
