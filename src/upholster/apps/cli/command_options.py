"""Options of a command, made from an options dataclass, which defines names, defaults and help."""

import functools
import inspect
from collections.abc import Callable, Collection
from dataclasses import Field, fields, is_dataclass
from typing import Annotated, Any

import typer

from upholster.apps.cli.console import byte_count, large_count, numbers, share, texel_count, view_angles
from upholster.base.errors import InputError
from upholster.base.options.choices import chosen
from upholster.base.options.option_fields import repeats

__all__ = ["by_name", "number_or_text", "spelled_out"]

_Read = Callable[[Any], Any]
_Write = Callable[[Any], str]

_AS_TEXT: dict[str, tuple[_Read, _Write]] = {
    "rectify": (lambda texts: tuple(numbers("rectify", text, ",", 2, float) for text in texts), str),
    "crop": (lambda text: numbers("crop", text, ",", 4, int), str),
    "resize": (str, str),
    "maps": (lambda texts: by_name("map", "role=file, as roughness=rough.png", texts), str),
    "texels": (texel_count, str),
    "sample_size": (lambda text: number_or_text(text), str),
    "element_size": (lambda text: number_or_text(text), str),
    "blend": (lambda text: number_or_text(text), str),
    "direction": (lambda texts: _by_part("direction", texts), str),
    "texture": (str, str),
    "coefficients": (lambda text: share("coefficients", text), str),
    "size": (lambda text: numbers("size", text, "x", 2, int), lambda size: f"{size[0]}x{size[1]}"),
    "view": (view_angles, lambda view: f"{view[0]:g},{view[1]:g}"),
    "displace": (str, str),
    "triangles": (lambda text: large_count("triangles", text), str),
    "sample_quality": (lambda text: number_or_text(text), lambda quality: f"{quality:g}"),
    "stream_bytes": (lambda text: byte_count("bytes", text), str),
}
"""How values on the command line are read and shown if they are not a plain number, word or switch."""


def number_or_text(text: str) -> float | str:
    """Return a number if a text is one, otherwise the text: its value is checked later."""
    try:
        return float(text)
    except ValueError:
        return text


def by_name(option: str, allowed: str, written: list[str]) -> dict[str, str]:
    """Read repeated options ``name=file``."""
    found: dict[str, str] = {}
    for text in written:
        name, equals, file = text.partition("=")
        if not (name and equals and file):
            raise InputError(f"{option} is {text!r}; allowed: {allowed}")
        if name in found:
            raise InputError(f"{option} {name!r} is given twice: {found[name]!r} and {file!r}")
        found[name] = file
    return found


def _by_part(name: str, texts: list[str]) -> str | dict[str, str]:
    """Read repeated options ``PART=VALUE``; a value alone is for all parts, or for all other parts."""
    if len(texts) == 1 and "=" not in texts[0]:
        return texts[0]
    found: dict[str, str] = {}
    for text in texts:
        part, _, value = text.rpartition("=")
        if not value or (part or "*") in found:
            raise InputError(f"{name} is given as {text!r}; allowed: PART=VALUE, each part once")
        found[part or "*"] = value
    if "*" in found:  # last, wherever it was given
        found["*"] = found.pop("*")
    return found


_WORDS: dict[str, Any] = {
    "rectify": tuple[str, str, str, str] | None,
    "maps": list[str] | None,
    "direction": list[str] | None,
}
"""Options of several words, or that are read from several texts; besides those that repeat."""


def spelled_out(*, without: Collection[str] = ()) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make a command take the fields of its options dataclasses as options, at the dataclass's position.

    The command itself is called with the dataclasses, built from the command line.

    Parameters
    ----------
    without
        Panels whose options the command omits, or names of options.
    """

    def spell_out(command: Callable[..., None]) -> Callable[..., None]:
        own: list[inspect.Parameter] = [_parameter("context", typer.Context)]
        kinds: dict[str, tuple[Any, list[Field[Any]]]] = {}
        for parameter in inspect.signature(command).parameters.values():
            kind = parameter.annotation
            if is_dataclass(kind):
                entries = [
                    entry for entry in fields(kind) if not {entry.name, entry.metadata["panel"]} & {*without}
                ]
                kinds[parameter.name] = kind, entries
                own += [_option(entry) for entry in entries]
            else:
                own.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))

        @functools.wraps(command)
        def run(context: typer.Context, **values: Any) -> None:
            for name, (kind, entries) in kinds.items():
                texts = {entry.name: values.pop(entry.name) for entry in entries}
                # Options that were not written are not passed on: a default of another method was not chosen.
                given = {
                    key: _AS_TEXT[key][0](value) if key in _AS_TEXT else value
                    for key, value in texts.items()
                    if _is_written(context, key)
                }
                values[name] = chosen(kind, **given)
            command(**values)

        run.__signature__ = inspect.Signature(own)  # type: ignore[attr-defined]  # inspect reads it from any function
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in own}
        return run

    return spell_out


def _option(entry: "Field[Any]") -> inspect.Parameter:
    about = entry.metadata
    name = about["flag"] or "--" + entry.name.replace("_", "-")
    # A switch that is on by default gets a name that turns it off.
    names = f"{name}/--no-{name[2:]}" if entry.default is True else name
    kind, default = entry.type, entry.default
    if entry.name in _AS_TEXT:
        kind, default = (str | None, None) if default is None else (str, _AS_TEXT[entry.name][1](default))
        kind = _WORDS.get(entry.name, kind)
    elif repeats(entry):
        kind = list[str] | None
    option = typer.Option(names, help=about["help"], metavar=about["metavar"], rich_help_panel=about["panel"])
    return _parameter(entry.name, Annotated[kind, option], default)


def _parameter(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _is_written(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name != "DEFAULT"
