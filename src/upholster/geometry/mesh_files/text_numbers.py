"""Parsing numbers of text files in bulk."""

import warnings
from collections.abc import Sequence

import numpy as np

from upholster.errors import FormatError
from upholster.types import FloatArray

__all__ = ["numbers_of"]


def numbers_of(text: bytes, what: str) -> FloatArray:
    """Return all numbers of a text, (n,) float64.

    Raises
    ------
    FormatError
        If something in it is not a finite number; `what` names the text.
    """
    if not text.strip():
        return np.zeros(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy's sign that it stopped at something else
        try:
            found = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise FormatError(f"{what} are not numbers: {_first_bad(text.split())}") from None
    if not np.isfinite(found).all():
        raise FormatError(f"{what} are not all finite")
    return found


def _first_bad(words: Sequence[bytes]) -> str:
    for word in words:
        try:
            float(word)
        except ValueError:
            return repr(word[:30].decode("ascii", "replace"))
    return "unreadable"
