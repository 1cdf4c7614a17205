"""Docstrings are true: what they list is what there is."""

import ast
import re

from sources import SOURCES, Function, definitions


def _listed(node: ast.ClassDef | Function, section: str) -> list[str]:
    """Return the names that a section of a docstring describes."""
    text = ast.get_docstring(node) or ""
    found = re.search(rf"^{section}\n-+\n(.*?)(?=^\w[^\n]*\n-+$|\Z)", text, re.MULTILINE | re.DOTALL)
    heads = re.findall(r"^[\w*].*$", found[1], re.MULTILINE) if found else []
    return [name.strip(" *") for head in heads for name in head.split(":")[0].split(",")]


def test_every_field_is_described_once() -> None:
    wrong = {}
    for name, node in definitions():
        listed = _listed(node, "Attributes")
        if isinstance(node, ast.ClassDef) and listed:
            targets = [field.target for field in node.body if isinstance(field, ast.AnnAssign)]
            fields = {target.id for target in targets if isinstance(target, ast.Name)}
            missing = {field for field in fields - set(listed) if not field.startswith("_")}
            if missing or len(listed) != len(set(listed)):
                wrong[name] = missing
    # What a base class describes, such as the name of a method, is not described again.
    assert wrong == {"synthesis/paper/method.py: PaperOptions": {"method"}}


def test_every_parameter_is_described_once() -> None:
    wrong = {}
    for name, node in definitions():
        listed = _listed(node, "Parameters")
        if isinstance(node, ast.ClassDef) or not listed:
            continue
        arguments = node.args
        named = {arg.arg for arg in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)}
        before = set(re.findall(r"`(\w+)`", (ast.get_docstring(node) or "").partition("\nParameters\n")[0]))
        missing = {arg for arg in named - set(listed) - before - {"self", "cls"} if not arg.startswith("_")}
        unknown = set(listed) - named if arguments.kwarg is None else set()
        unknown -= {arg.arg for arg in (arguments.vararg,) if arg is not None}
        if missing or unknown or len(listed) != len(set(listed)):
            wrong[name] = missing | unknown
    assert not wrong


def test_every_folder_names_its_modules() -> None:
    missing = {}
    for init in sorted(SOURCES.rglob("__init__.py")):
        # CONVENTIONS.md names those of the package itself.
        own = init.parent != SOURCES / "upholster"
        text = (init if own else SOURCES.parent / "CONVENTIONS.md").read_text(encoding="utf-8")
        text = text.partition("\n## Folders\n")[2].partition("\n## ")[0] if not own else text
        modules = [path for path in init.parent.iterdir() if path.suffix == ".py"]
        folders = [path.parent for path in init.parent.glob("*/__init__.py")]
        names = {path.stem for path in (*modules, *folders) if not path.stem.startswith("_")}
        if unnamed := {name for name in names if f"`{name}`" not in text}:
            missing[init.parent.relative_to(SOURCES).as_posix()] = unnamed
    assert missing == {}
