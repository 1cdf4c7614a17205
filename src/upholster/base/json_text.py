"""JSON from outside: texts that later code can take apart, copy and send without further checks."""

import json
from typing import Any

from upholster.base.errors import FormatError

__all__ = ["read_json"]

_DEEPEST = 100
"""Most levels of lists and objects: functions that follow them, Python's own too, fail at some thousands."""

_MOST_DIGITS = 300
"""Longer integers become no floating-point number."""


def read_json(text: str | bytes) -> Any:
    """Return the value of a JSON text.

    Raises
    ------
    FormatError
        If it is not JSON; if it is nested more than 100 levels deep, or has a number that no double-precision
        number is near.
    """
    try:
        found = json.loads(text, parse_int=_integer, parse_float=_float, parse_constant=_float)
    except RecursionError:
        raise FormatError(_TOO_DEEP) from None
    except ValueError as error:
        raise FormatError(f"it is not JSON: {error}") from None
    _check_depth(found, _DEEPEST)
    return found


_TOO_DEEP = f"it is not JSON of use here: nested too deep; allowed: {_DEEPEST} levels"


def _integer(text: str) -> int:
    if len(text) > _MOST_DIGITS:
        raise ValueError(f"a number of {len(text)} digits; allowed: {_MOST_DIGITS}")
    return int(text)


def _float(text: str) -> float:
    found = float(text)
    if not abs(found) < float("inf"):
        raise ValueError(f"{text[:20]} is no number; allowed: up to 1e308")
    return found


def _check_depth(value: Any, left: int) -> None:
    if not isinstance(value, list | dict):
        return
    if not left:
        raise FormatError(_TOO_DEEP)
    for inner in value.values() if isinstance(value, dict) else value:
        _check_depth(inner, left - 1)
