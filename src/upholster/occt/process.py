"""Reading a CAD file in a process of its own."""

import json
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

from upholster.errors import InputError
from upholster.occt.records import CadRecord

__all__ = ["MEMORY", "SECONDS", "read_cad"]

SECONDS = 600.0
"""How long reading may take."""

MEMORY = 12 << 30
"""Bytes of address space that it may use; of memory that is about a quarter less."""

_EXTRAS = {"OCP": "cad", "rhino3dm": "rhino"}


def read_cad(
    path: Path,
    *,
    deviation: float | None = None,
    unique: bool = False,
    unit: float | None = None,
    coarse: bool = False,
    seconds: float = SECONDS,
    memory: int = MEMORY,
) -> CadRecord:
    """Read a CAD file: STEP, IGES and BREP by Open CASCADE, 3DM by rhino3dm as well.

    Parameters
    ----------
    path
        The file, with one of `upholster.suffixes.CAD_SUFFIXES`.
    deviation
        How far triangles may lie from their faces, in millimetres; by default a two-thousandth of the size.
    unique
        Whether a shape that stands in several places is a body in each.
    unit
        Length of the file's unit in millimetres, where it tells none itself.
    coarse
        Whether few triangles will do, to know what there is.
    seconds, memory
        How long reading may take, and how much memory, in bytes.

    Raises
    ------
    InputError
        If what reads it is not installed; if it can not be read, has no faces, or needs more than the limits.
    """
    options = {"unit": unit, "deviation": deviation, "unique": unique, "coarse": coarse, "memory": memory}
    with tempfile.TemporaryDirectory(prefix="upholster-") as folder:
        result = Path(folder, "result")
        command = [sys.executable, "-m", "upholster.occt", str(path), str(result), json.dumps(options)]
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=_environment(),
        )
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise InputError(f"takes more than {seconds:g} s to read; allowed: as much") from None
        finally:  # also when the user stops the program
            process.kill()
            process.wait()
        found: CadRecord | str | None = pickle.loads(result.read_bytes()) if result.is_file() else None
    if found is None:
        raise InputError(f"Open CASCADE crashes on it (status {code}): it can not be read")
    if isinstance(found, str):
        raise _refused(found, memory)
    if not any(body.faces for body in found.bodies):
        raise InputError("it has no surfaces; allowed: a model with faces")
    return found


def _refused(text: str, memory: int) -> InputError:
    if text == "memory":
        return InputError(f"it needs more than {memory / 2**30:.3g} GiB of memory to read; allowed: as much")
    missing, _, name = text.partition(" ")
    if missing == "missing":
        extra = _EXTRAS.get(name.partition(".")[0])
        if extra is not None:
            return InputError(f"reading it needs {name}; install it: pip install 'upholster[{extra}]'")
    return InputError(text)


def _environment() -> dict[str, str]:
    """Return the environment, in which the process finds this package wherever it lies."""
    root = str(Path(__file__).parents[2])
    known = os.environ.get("PYTHONPATH")
    return os.environ | {"PYTHONPATH": root if not known else f"{root}{os.pathsep}{known}"}
