"""Options of a kind from choices by name."""

import secrets
from collections.abc import Mapping
from dataclasses import fields, replace
from numbers import Integral
from typing import Any, TypeAlias, TypeVar

from upholster.base.errors import InputError, nearest
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions, check_owner
from upholster.base.options.write_options import WriteOptions

__all__ = ["Options", "chosen", "method_options", "seed_number"]

Kind = TypeVar("Kind", SampleOptions, ModelOptions, SynthesisOptions, WriteOptions)
MethodOptions = TypeVar("MethodOptions", bound=SynthesisOptions)
Options: TypeAlias = SampleOptions | ModelOptions | SynthesisOptions | WriteOptions


def chosen(kind: type[Kind], base: Kind | Mapping[str, Any] | None = None, **choices: Any) -> Kind:
    """Return options of a kind: `base` with `choices` applied; a choice of None is ignored.

    Raises
    ------
    InputError
        For an unknown name, or a value that the options refuse; also if a choice belongs to another method,
        even if it is that option's default.
    """
    if base is None or isinstance(base, Mapping):
        choices = dict(base or {}) | choices
        base = kind()
    if not isinstance(base, kind):
        raise InputError(f"options are a {type(base).__name__}; allowed: {kind.__name__}, or options by name")
    known = {entry.name: entry for entry in fields(kind)}
    for name in choices:
        if name not in known:
            raise InputError(f"unknown option {name!r}; {nearest(str(name), known)}")
    given = {name: value for name, value in choices.items() if value is not None}
    found = replace(base, **given)
    if isinstance(found, SynthesisOptions):
        check_owner(found.method, [known[name] for name in given])
    return found


def method_options(options: SynthesisOptions, kind: type[MethodOptions], **found: Any) -> MethodOptions:
    """Return options as a method's own kind: open values come from `found`, or are the method's defaults."""
    given = {entry.name: getattr(options, entry.name) for entry in fields(options)} | found
    return kind(**{name: value for name, value in given.items() if value is not None})


def seed_number(seed: int | None) -> int:
    """Return a seed as a number; for None a new one, drawn from the system.

    Raises
    ------
    InputError
        If it is neither None nor 0 to 2^63 − 1.
    """
    if seed is None:
        return secrets.randbits(32)
    if not (isinstance(seed, Integral) and 0 <= seed < 2**63):
        raise InputError(f"seed is {seed!r}; allowed: 0 to 2^63 - 1")
    return int(seed)
