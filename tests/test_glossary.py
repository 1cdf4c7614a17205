"""One word means one thing: names in the sources, and the tables of words in CONVENTIONS.md."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from sources import SOURCES, trees

from upholster.apps.cli import app

ROOT = Path(__file__).parent.parent
WEB = ROOT / "web"
CONVENTIONS = (ROOT / "CONVENTIONS.md").read_text(encoding="utf-8")

SHARED_MODULES = {
    "__init__": "Python's own",
    "__main__": "Python's own",
    "_kernels": "the kernels of its folder",
    "method": "one for each method of synthesis",
    "obj": "one format, read and written",
    "ply": "one format, read and written",
    "stl": "one format, read and written",
    "three_mf": "one format, read and written",
}
"""Names that several modules have, and why. Commands in ``cli`` are named after themselves."""


def _commands() -> set[str]:
    """Return the commands: each is a function, in a module of its own or in one of its kind."""
    return {command.callback.__name__ for command in app.registered_commands if command.callback}


def _table(heading: str) -> list[tuple[str, str]]:
    """Return the rows of a table in CONVENTIONS.md: two columns."""
    section = re.split(r"^#+ ", CONVENTIONS, flags=re.MULTILINE)
    (text,) = (part for part in section if part.startswith(heading + "\n"))
    rows = re.findall(r"^\| (.+?) \| (.+?) \|$", text, re.MULTILINE)
    return [(left, right) for left, right in rows[1:] if set(left) != {"-"}]


def _identifiers(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                yield name


def _words(identifier: str) -> list[str]:
    """Return the words of a name in small letters, ``["chart", "grid"]`` of ``ChartGrid``."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", identifier)
    return [word for word in spaced.lower().split("_") if word]


def test_no_two_modules_have_one_name() -> None:
    places = defaultdict(list)
    for path in trees():
        folder, _, name = path.rpartition("/")
        if not (folder == "apps/cli" and name.removesuffix(".py") in {*_commands(), "codec", "stream"}):
            places[name.removesuffix(".py")].append(path)
    twice = {name: found for name, found in places.items() if len(found) > 1}
    assert set(twice) == set(SHARED_MODULES), twice


def test_no_two_scripts_have_one_name() -> None:
    folders = {path.name for path in WEB.iterdir() if path.is_dir()} - {"node_modules", "examples"}
    names = [path.name for path in WEB.glob("*.js")]
    names += [path.name for folder in folders for path in (WEB / folder).rglob("*.js")]
    assert len(names) > 80
    assert len(set(names)) == len(names)


def test_the_words_of_the_glossary_are_used() -> None:
    text = "\n".join(file.read_text(encoding="utf-8") for file in SOURCES.rglob("*.py")).lower()
    used = set(re.findall(r"[a-z]+", text))
    words = [word for word, _ in _table("Words")]
    assert len(words) > 50
    assert [word for word in words if not all({part, part + "s"} & used for part in word.split())] == []


def test_no_identifier_has_a_word_that_the_glossary_forbids() -> None:
    forbidden = {word: instead for words, instead in _table("Not these") for word in words.split(", ")}
    assert forbidden
    found = {
        f"{path}: {name}, rather: {forbidden[word]}"
        for path, tree in trees().items()
        for name in _identifiers(tree)
        for word in _words(name)
        if word in forbidden
    }
    assert found == set()
