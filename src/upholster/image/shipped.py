"""Samples included in the program, by name: ``sample:bricks``."""

import os
from pathlib import Path

from upholster.errors import InputError, nearest

__all__ = ["SHIPPED_PREFIX", "sample_path", "shipped_folder", "shipped_samples"]

SHIPPED_PREFIX = "sample:"

_PACKAGE = Path(__file__).parents[1]
_PLACES = (_PACKAGE / "studio" / "examples", _PACKAGE.parents[1] / "examples")
"""In an installed package; in a checkout."""


def shipped_folder() -> Path:
    """Return the folder of samples and models included in the program."""
    return next((place for place in _PLACES if place.is_dir()), _PLACES[0])


def shipped_samples() -> dict[str, Path]:
    """Return the files of the included samples, by name."""
    return {file.stem: file for file in sorted(shipped_folder().glob("*.png"))}


def sample_path(path: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """Return a path unchanged, or the file of an included sample that it names.

    Parameters
    ----------
    path
        A file, or ``sample:NAME``. For a file whose own name begins so, write ``./sample:NAME``.

    Raises
    ------
    InputError
        If the program includes no such sample.
    """
    text = os.fspath(path)
    if not (isinstance(text, str) and text.startswith(SHIPPED_PREFIX)):
        return path
    name, known = text.removeprefix(SHIPPED_PREFIX), shipped_samples()
    if name not in known:
        raise InputError(f"no sample {name!r} comes with the program; {nearest(name, known)}")
    return str(known[name])
