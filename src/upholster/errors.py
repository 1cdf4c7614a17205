"""What can go wrong, said in one line: the value's name, what is wrong with it, what is allowed."""

import difflib
from collections.abc import Iterable

__all__ = ["FormatError", "InputError", "UpholsterError", "nearest"]


class UpholsterError(Exception):
    """Base of every error that upholster raises on purpose."""


class InputError(UpholsterError):
    """An argument, an option or a file's content is outside what is allowed."""


class FormatError(UpholsterError):
    """A file of a known format is damaged or breaks the format's rules."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Say which names are known, nearest first: ``"did you mean 'torus'? (known: cyclide, torus)"``.

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
