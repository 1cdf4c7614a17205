"""Checks of the builders' parameters: one-line errors with name, value and limits."""

from numbers import Integral, Real

from upholster.base.errors import InputError

__all__ = ["LARGEST_LENGTH", "MOST_SPANS", "check_length", "check_spans"]

LARGEST_LENGTH = 1e9
MOST_SPANS = 256


def check_length(name: str, value: float, *, zero: bool = False) -> float:
    """Return a length, 1e-9 to 1e9 in the model's units, or 0 if `zero` allows it."""
    ok = isinstance(value, Real) and (
        1.0 / LARGEST_LENGTH <= value <= LARGEST_LENGTH or (zero and value == 0)
    )
    if not ok:
        least = "0, or " if zero else ""
        raise InputError(f"{name} is {value!r}; allowed: {least}{1 / LARGEST_LENGTH:g} to {LARGEST_LENGTH:g}")
    return float(value)


def check_spans(name: str, value: int, *, least: int, even: bool = False) -> int:
    """Return a number of spans, `least` to 256, and even if it has to be."""
    ok = isinstance(value, Integral) and least <= value <= MOST_SPANS and not (even and value % 2)
    if not ok:
        kind = "even numbers" if even else "whole numbers"
        raise InputError(f"{name} is {value!r}; allowed: {kind} from {least} to {MOST_SPANS}")
    return int(value)
