"""Fields of options: their metadata, and the types that their values are converted to."""

from collections.abc import Sequence
from dataclasses import Field, fields
from inspect import cleandoc
from numbers import Integral, Real
from types import UnionType
from typing import Any, Literal, get_args, get_origin

from upholster.base.display import on_a_line
from upholster.base.errors import InputError

__all__ = ["METHODS", "about", "convert_types", "differing", "documented", "members", "repeats"]

METHODS = ("quilt", "paper", "pixel")

_WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    bool: "True or False",
    str: "a text",
    tuple[int, int]: "two whole numbers",
    tuple[float, float]: "two numbers",
    tuple[str, ...]: "texts",
}
"""The types that an option can have, in words for messages."""


def about(
    panel: str,
    text: str,
    *,
    metavar: str | None = None,
    only: str | tuple[str, ...] = METHODS,
    flag: str | None = None,
) -> dict[str, Any]:
    """Return a field's metadata: panel, help text, and the methods that it applies to."""
    only = (only,) if isinstance(only, str) else only
    return {"panel": panel, "help": text, "metavar": metavar, "only": only, "flag": flag}


def documented(kind: type[Any]) -> type[Any]:
    """Add the fields' help to a class's docstring, as a section of attributes."""
    attributes = [f"{entry.name}\n    {entry.metadata['help']}" for entry in fields(kind)]
    kind.__doc__ = "\n".join([cleandoc(kind.__doc__ or ""), "", "Attributes", "----------", *attributes])
    return kind


def differing(options: Any) -> dict[str, Any]:
    """Return the options that differ from their defaults, by name."""
    values = {entry.name: (getattr(options, entry.name), entry.default) for entry in fields(options)}
    return {name: value for name, (value, default) in values.items() if value != default}


def repeats(entry: "Field[Any]") -> bool:
    """Return whether an option is several texts, each written as an option of its own."""
    return entry.type == tuple[str, ...] | None


def convert_types(options: Any) -> None:
    """Bring each option to its type: NumPy's numbers to Python's, lists to tuples; refuse others.

    A text alone becomes a tuple of one text if its option `repeats`.
    """
    for entry in fields(options):
        if isinstance(entry.type, str):  # the direction, which has many forms
            continue
        kinds = get_args(entry.type) if isinstance(entry.type, UnionType) else (entry.type,)
        kinds = tuple(str if get_origin(kind) is Literal else kind for kind in kinds)
        value = getattr(options, entry.name)
        try:
            converted = next(found for kind in kinds for found in _as_kind(kind, value))
        except StopIteration:
            allowed = " or ".join(_WORDS[kind] for kind in kinds if kind in _WORDS)
            raise InputError(f"{entry.name} is {on_a_line(value)}; allowed: {allowed}") from None
        object.__setattr__(options, entry.name, converted)


def _as_kind(kind: Any, value: Any) -> list[Any]:
    """Return `value` converted to a type, in a list; the list is empty if it can not be converted."""
    if kind is type(None):
        return [None] if value is None else []
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return [bool(value)] if kind is bool else []
    if kind is int:
        # 4e6 is a whole number as well.
        whole = isinstance(value, Integral) or (isinstance(value, Real) and float(value).is_integer())
        return [int(value)] if whole else []
    if kind is float:
        return [float(value)] if isinstance(value, Real) else []
    if kind is str:
        return [value] if isinstance(value, str) else []
    if kind == tuple[str, ...] and isinstance(value, str):
        return [(value,)]
    if get_origin(kind) is tuple and not isinstance(value, (str, bytes)):
        parts = members(value)
        if get_args(kind)[1:] == (Ellipsis,):
            kind = tuple[(get_args(kind)[0],) * len(parts or ())]  # type: ignore[misc]  # built at run time
        if parts is not None and len(parts) == len(get_args(kind)):
            found = [_as_kind(part, one) for part, one in zip(get_args(kind), parts, strict=True)]
            return [tuple(one[0] for one in found)] if all(found) else []
    return []


def members(value: Any) -> list[Any] | None:
    """Return the members of a list, tuple or flat array; None if `value` is none of them."""
    if isinstance(value, Sequence) or getattr(value, "ndim", None) == 1:
        return list(value)
    return None
