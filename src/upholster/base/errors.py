"""Errors in one line each: the value's name, what is wrong with it, and what is allowed."""

import difflib
from collections.abc import Iterable
from numbers import Integral

__all__ = [
    "CancelledError",
    "FormatError",
    "InputError",
    "StoppedError",
    "UpholsterError",
    "check_whole",
    "nearest",
    "printable",
]


_LONGEST = 600
"""Largest number of characters of an error: a wrong value may be long."""


class UpholsterError(Exception):
    """Base of every error that upholster raises on purpose: its text is always one line."""

    def __str__(self) -> str:
        text = printable(" ".join(line.strip() for line in super().__str__().splitlines()))
        return text if len(text) <= _LONGEST else text[: _LONGEST // 2] + " … " + text[-_LONGEST // 2 :]


class InputError(UpholsterError):
    """An argument, an option or a file's content is outside what is allowed."""


class FormatError(UpholsterError):
    """A file of a known format is damaged or breaks the format's rules."""


class CancelledError(UpholsterError):
    """Work was stopped because its result is no longer wanted."""


class StoppedError(UpholsterError):
    """The user has stopped work that is partly done: the text says which part."""


def check_whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number as Python's own.

    Raises
    ------
    InputError
        If it is not a whole number, below `least` or above `most`.
    """
    if isinstance(value, Integral):
        number = int(value)
        if least <= number and (most is None or number <= most):
            return number
    allowed = f"{least} or more" if most is None else f"{least} to {most}"
    raise InputError(f"{name} is {value!r}; allowed: {allowed}")


def printable(text: str) -> str:
    r"""Return text with an escape (``\x1b``) for each character that would not show as one.

    Names of files, and texts in files, may contain anything: control sequences for the terminal, marks that
    reverse the reading direction, halves of characters that cannot be printed at all.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def nearest(name: str, known: Iterable[str]) -> str:
    """List the known names, nearest first: ``"did you mean 'torus'? (known: cyclide, torus)"``.

    Parameters
    ----------
    name
        What the user wrote.
    known
        The names that exist.
    """
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    listed = ", ".join(names)
    return f"did you mean {close[0]!r}? (known: {listed})" if close else f"known: {listed}"
