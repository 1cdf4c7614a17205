"""Samples and models included in the program, by name: ``sample:bricks``, ``sample:chair``."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from upholster.base.errors import InputError, nearest

__all__ = [
    "INCLUDED_PREFIX",
    "either_path",
    "included_models",
    "included_samples",
    "model_path",
    "sample_path",
]

Named = TypeVar("Named")

INCLUDED_PREFIX = "sample:"

_PACKAGE = Path(__file__).parents[1]
_PLACES = (_PACKAGE / "apps" / "studio" / "examples", _PACKAGE.parents[1] / "examples")
"""In an installed package; in a checkout."""


def _folder() -> Path:
    """Return the folder of samples and models included in the program."""
    return next((place for place in _PLACES if place.is_dir()), _PLACES[0])


def included_samples() -> dict[str, Path]:
    """Return the files of the included samples, by name."""
    return {file.stem: file for file in sorted(_folder().glob("*.png"))}


def included_models() -> dict[str, Path]:
    """Return the files of the included models, by name."""
    return {file.stem: file for file in sorted(_folder().glob("*.glb"))}


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
    return _included(path, "sample", included_samples)


def model_path(on: Named) -> Named | str:
    """Like `sample_path`, for a model; anything that is no text or path is returned unchanged, too."""
    return _included(on, "model", included_models)


def either_path(file: str) -> str:
    """Like `sample_path`, for a sample or a model."""
    return _included(file, "sample or model", lambda: included_samples() | included_models())


def _included(path: Named, what: str, included: Callable[[], dict[str, Path]]) -> Named | str:
    text = str(path) if isinstance(path, str | os.PathLike) else ""
    if not text.startswith(INCLUDED_PREFIX):
        return path
    name, known = text.removeprefix(INCLUDED_PREFIX), included()
    if name not in known:
        raise InputError(f"no {what} {name!r} comes with the program; {nearest(name, known)}")
    return str(known[name])
