"""Text files: their encoding, and parsing their numbers in bulk."""

import codecs
import math
import warnings
from collections.abc import Callable

import numpy as np

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray

__all__ = ["in_utf8", "numbers_of"]


def in_utf8(data: bytes) -> bytes:
    """Return text in UTF-8 without its mark; bytes that are not text in UTF-16 or UTF-8 stay as they are."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            return data.decode("utf-16").encode("utf-8")
        except UnicodeDecodeError:
            return data
    return data.removeprefix(codecs.BOM_UTF8)


def numbers_of(text: bytes, what: str, place: Callable[[int], str]) -> FloatArray:
    """Return all numbers of a text, (n,) float64.

    Parameters
    ----------
    text
        The numbers, in lines.
    what
        The text's name in errors.
    place
        Returns the place in the file of a line of `text`, such as ``"line 7"``, for errors.

    Raises
    ------
    FormatError
        If something in it is not a finite number: with its place.
    """
    if not text.strip():
        return np.zeros(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy's sign that it stopped at something else
        try:
            found = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise FormatError(_first_bad(text, what, place)) from None
    if not np.isfinite(found).all():
        raise FormatError(_first_bad(text, what, place))
    return found


def _first_bad(text: bytes, what: str, place: Callable[[int], str]) -> str:
    for row, line in enumerate(text.split(b"\n")):
        for word in line.split():
            shown = repr(word[:30].decode("ascii", "replace"))
            try:
                value = math.nan if b"_" in word else float(word)
            except ValueError:
                return f"{place(row)}: {what} are not numbers: {shown}"
            if not math.isfinite(value):
                return f"{place(row)}: {what} are not all finite: {shown}"
    return f"{what} are unreadable"
