"""``upholster info`` for a project."""

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from upholster.apps.cli.console import say
from upholster.base.options.option_fields import differing

if TYPE_CHECKING:
    from upholster.image.files.source import Sample

__all__ = ["show_project"]


def show_project(path: str) -> None:
    """Print a project's model, samples, and the settings that are not defaults; one per line."""
    from upholster.apps.project.file import read_project
    from upholster.apps.project.project import KINDS
    from upholster.charts.surface_to_cover import covered_files

    project = read_project(path)
    folder = os.path.dirname(path) or "."
    model = project.model
    lines: dict[str, Any] = {"model": _short(model, folder) if covered_files(model) else model}
    if project.sample is not None:
        lines["sample"] = _sample(project.sample, folder)
    lines |= {f"part {name}": _sample(sample, folder) for name, sample in project.materials.items()}
    lines |= {name: _settings(differing(getattr(project, name))) for name in KINDS}
    lines["seed"] = project.seed
    if project.pinned is not None:
        lines["pinned"] = ", ".join(project.pinned.regions)
    say(f"{path}:")
    for name, text in lines.items():
        if text != "":
            say(f"{name}: {text}")
    for note in project.notes:
        say(f"note: {note}")


def _sample(sample: "Sample", folder: str) -> str:
    source: Any = sample.source
    if isinstance(source, Mapping):
        named = ", ".join(f"{role} {_short(file, folder)}" for role, file in source.items())
    else:
        named = ", ".join(_short(file, folder) for file in ([source] if isinstance(source, str) else source))
    size = "" if sample.size is None else f" @ {sample.size}"
    settings = _settings(differing(sample.options))
    return f"{named}{size}" + (f", {settings}" if settings else "")


def _short(file: Any, folder: str) -> str:
    return os.path.relpath(os.fspath(file), folder)


def _settings(changed: Mapping[str, Any]) -> str:
    """Write options as on the command line."""
    return ", ".join(f"{name.replace('_', '-')} {_text(value)}" for name, value in changed.items())


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return " ".join(f"{key}={each}" for key, each in value.items())
    if isinstance(value, tuple | list):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
