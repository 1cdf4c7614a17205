"""Python's public names as Markdown: what ``upholster.__all__`` has, by kind, from docstrings."""

import inspect
from types import ModuleType

import upholster

__all__ = ["markdown"]

_FUNCTIONS, _CLASSES, _OPTIONS, _ERRORS, _MODULES = "Functions", "Classes", "Options", "Errors", "Measures"


def markdown() -> str:
    """Return a section for each kind of name, each with all its names in alphabetical order."""
    found: dict[str, list[str]] = {kind: [] for kind in (_FUNCTIONS, _CLASSES, _OPTIONS, _ERRORS, _MODULES)}
    for name in upholster.__all__:
        if not name.startswith("__"):
            found[_kind(name)].append(name)
    sections = [_section(kind, sorted(names, key=str.lower)) for kind, names in found.items()]
    return "\n".join(sections)


def _kind(name: str) -> str:
    thing = getattr(upholster, name)
    if isinstance(thing, ModuleType):
        return _MODULES
    if not inspect.isclass(thing):
        return _FUNCTIONS
    if issubclass(thing, Exception):
        return _ERRORS
    return _OPTIONS if name.endswith("Options") else _CLASSES


def _section(kind: str, names: list[str]) -> str:
    listed = [line for name in names for line in _directives(f"upholster.{name}", getattr(upholster, name))]
    return "\n".join([f"## {kind}", "", "```{eval-rst}", *listed, "```", ""])


def _directives(path: str, thing: object) -> list[str]:
    """Return what autodoc needs to document a name; of a module its public names."""
    if isinstance(thing, ModuleType):
        names = [f"{path}.{name}" for name in thing.__all__]
        return [line for name in names for line in _directives(name, _found(thing, name))]
    if inspect.isclass(thing) and issubclass(thing, Exception):
        return [f".. autoexception:: {path}", ""]
    # The fields of options stand in their docstrings: as members they would come twice.
    if inspect.isclass(thing) and path.endswith("Options"):
        return [f".. autoclass:: {path}", "   :no-members:", ""]
    return [f".. {'autoclass' if inspect.isclass(thing) else 'autofunction'}:: {path}", ""]


def _found(module: ModuleType, path: str) -> object:
    return getattr(module, path.rpartition(".")[2])
