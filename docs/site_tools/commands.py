"""The command line as Markdown, made of the same commands and options as ``upholster --help``."""

from typing import Any

import typer

from upholster.apps.cli import app

__all__ = ["markdown"]

_NOT_SAID: tuple[object, ...] = (None, False, (), [])
"""Defaults that say nothing: what is not given, or not switched on."""


def markdown() -> str:
    """Return a heading for each command, and below it its arguments and options in tables."""
    group: Any = typer.main.get_command(app)
    lines = ["| command | does |", "| --- | --- |"]
    for name, command in group.commands.items():
        lines.append(f"| [`{name}`](#upholster-{name}) | {_cell(command.help.splitlines()[0])} |")
    for name, command in group.commands.items():
        lines += ["", *_command(name, command)]
    return "\n".join(lines) + "\n"


def _command(name: str, command: Any) -> list[str]:
    """Return the section of a command: what it does, how it is called, and each option once."""
    shown = [param for param in command.params if not getattr(param, "hidden", False)]
    arguments = [param for param in shown if param.param_type_name == "argument"]
    must = [_spelled(param) for param in shown if param.required and param.param_type_name == "option"]
    usage = " ".join(["upholster", name, *map(_argument, arguments), *must])
    lines = [f"## `upholster {name}`", "", command.help, "", "```text", f"{usage} [OPTIONS]", "```"]
    panels: dict[str, list[Any]] = {}
    for param in shown:
        usual = "Arguments" if param in arguments else "Options"
        panels.setdefault(param.rich_help_panel or usual, []).append(param)
    for panel, params in panels.items():
        lines += ["", f"| {panel} | |", "| --- | --- |", *map(_row, params)]
    if command.epilog:
        lines += ["", command.epilog]
    return lines


def _argument(param: Any) -> str:
    told = param.metavar or param.name.upper()
    several = f"{told} …" if param.nargs == -1 else told
    return several if param.required else f"[{several}]"


def _spelled(param: Any) -> str:
    """Return the shortest name of an option, and what stands behind it."""
    return " ".join([min(param.opts, key=len), *_value(param)])


def _value(param: Any) -> list[str]:
    return [] if param.is_flag else [param.metavar or "VALUE"]


def _row(param: Any) -> str:
    if param.param_type_name == "argument":
        return f"| `{_cell(_argument(param))}` | {_cell(param.help)} |"
    names = ", ".join(f"`{name}`" for name in [*param.opts, *param.secondary_opts])
    # The value stands before its meaning: beside the name, a long one would leave no room for that.
    value = "".join(f"`{_cell(text)}` " for text in _value(param))
    default = "" if param.default in _NOT_SAID else f" *Default: {param.default}.*"
    return f"| {names} | {value}{_cell(param.help)}{'' if 'efault' in param.help else default} |"


def _cell(text: str) -> str:
    """Return text that stays in its cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
