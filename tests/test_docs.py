"""The documentation: its pages are all on the site, its links lead somewhere, and its recipes run."""

import re
import runpy
import shlex
import shutil
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
from documented import run_shown

from upholster.apps.cli import app

ROOT = Path(__file__).parent.parent
RECIPES = ROOT / "docs" / "recipes.md"
GLOBS = ("*.md", "docs/**/*.md", "web/*.md", "web/examples/*.md", "examples/*.md")
PAGES = sorted({page for pattern in GLOBS for page in ROOT.glob(pattern)})
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]+(?:\([^()]*\)[^()\s]*)*)\)")
INCLUDE = re.compile(r"^```\{include\} (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def _text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def _prose(page: Path) -> str:
    """Return a page without its blocks of code and its words of code, where brackets are no links."""
    without_blocks = re.sub(r"^(```|~~~).*?^\1$", "", _text(page), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]*`(?!\]\()", "", without_blocks)


@cache
def _anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and the site make them."""
    blocks = re.sub(r"^```.*?^```$", "", _text(page), flags=re.MULTILINE | re.DOTALL)
    found: set[str] = set()
    for heading in re.findall(r"^#{1,4} +(.+?)\s*$", blocks, re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        number = 0
        while (again := f"{anchor}-{number}" if number else anchor) in found:
            number += 1
        found.add(again)
    return found


def _links() -> list[tuple[Path, str]]:
    found = [(page, link) for page in PAGES for link in LINK.findall(_prose(page))]
    return [(page, link) for page, link in found if not re.match(r"[a-z]+:", link)]


def _contents() -> list[str]:
    """Return what the tables of contents in docs/index.md list, from the project's folder."""
    trees = re.findall(r"^```\{toctree\}\n(.*?)^```$", _text(ROOT / "docs" / "index.md"), re.M | re.S)
    lines = [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]
    names = [re.sub(r"^.*<(.*)>$", r"\1", line) for line in lines]
    return [str((ROOT / "docs" / f"{name}.md").resolve().relative_to(ROOT.resolve())) for name in names]


def test_every_page_is_in_the_table_of_contents_once() -> None:
    pages = [str(page.relative_to(ROOT)) for page in PAGES if page != ROOT / "docs" / "index.md"]
    assert sorted(_contents()) == sorted(pages)


def _leads_somewhere(page: Path, link: str) -> bool:
    path, _, anchor = link.partition("#")
    target = (page.parent / path).resolve() if path else page
    if not target.exists():
        # The source archive has no pictures.
        return target.suffix in (".jpg", ".png") and not (ROOT / "docs" / "gallery" / "hero.jpg").exists()
    return not anchor or target.suffix != ".md" or anchor in _anchors(target)


def test_every_relative_link_leads_somewhere() -> None:
    links = _links()
    assert len(links) > 200
    assert [f"{page.relative_to(ROOT)}: {to}" for page, to in links if not _leads_somewhere(page, to)] == []


def test_files_of_decisions_exist() -> None:
    found = set(re.findall(r"`((?:\w+/)*\w+\.py)`", _text(ROOT / "docs" / "decisions.md")))
    places = [(ROOT / "src" / "upholster" / name, ROOT / name) for name in found]
    assert len(found) > 50
    assert [package for package, own in places if not package.exists() and not own.exists()] == []


def test_what_pages_include_has_the_words_between_which_it_lies() -> None:
    blocks = [(page, *found) for page in PAGES for found in INCLUDE.findall(_text(page))]
    assert blocks
    for page, path, options in blocks:
        words = re.findall(r'^:(?:start-after|end-before): "(.*)"$', options, re.MULTILINE)
        text = _text(page.parent / path)
        assert [text.count(each) for each in words] == [1, 1], f"{page.relative_to(ROOT)}: {words}"


def _recipes() -> dict[str, list[str]]:
    """Return each recipe's commands by its heading."""
    sections = re.split(r"^## +", _text(RECIPES), flags=re.MULTILINE)[1:]
    return {section.splitlines()[0]: _commands(section) for section in sections}


def _commands(page: str) -> list[str]:
    """Return the commands in a page's blocks, without what is only a comment."""
    blocks = "".join(re.findall(r"^```console\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    return re.findall(r"^\$ (.*?)(?: +# .*)?$", re.sub(r" \\\n +", " ", blocks), re.MULTILINE)


def test_each_recipe_has_a_picture_and_a_command() -> None:
    recipes = _recipes()
    assert re.findall(r"\| \[([^\]]*)\]\(#", _text(RECIPES)) == list(recipes)
    assert len(recipes) == len(re.findall(r"^!\[[^\]]+\]\(", _text(RECIPES), re.MULTILINE)) == 17
    assert all(any("upholster " in command for command in commands) for commands in recipes.values())


def _check_taken(commands: list[str]) -> None:
    group: Any = typer.main.get_command(app)
    for program, *words in map(shlex.split, commands):
        if program == "upholster":
            group.commands[words[0]].make_context(words[0], words[1:])


@pytest.mark.parametrize("recipe", _recipes())
def test_the_command_line_takes_the_commands_of_a_recipe(recipe: str) -> None:
    _check_taken(_recipes()[recipe])


def test_the_command_line_takes_the_commands_for_the_papers_figures() -> None:
    commands = _commands(_text(ROOT / "docs" / "paper.md"))
    assert len(commands) > 10
    _check_taken(commands)


@pytest.mark.slow(reason="runs every command")
@pytest.mark.skipif(sys.platform == "win32", reason="the commands are written for a POSIX shell")
@pytest.mark.parametrize("recipe", _recipes())
def test_a_recipe_runs_by_itself_and_writes_what_it_names(
    recipe: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "[cad]" in _text(RECIPES).split(f"## {recipe}\n")[1].split("\n## ")[0]:
        pytest.importorskip("OCP")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    shutil.copytree(ROOT / "docs" / "guides", tmp_path / "docs" / "guides")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "src"))
    for command in _recipes()[recipe]:
        run_shown(command, tmp_path)
        for name in re.findall(r"(?:-o|--json|--sheet|>) ([\w.]+|'[^']+')(?= |$)", command):
            assert list(tmp_path.glob(name.strip("'").replace("<UDIM>", "1*"))), f"{command}: no {name}"


def test_the_command_lines_page_has_each_option_of_each_command_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    made: str = runpy.run_path(str(ROOT / "docs" / "site_tools" / "commands.py"))["markdown"]()
    group: Any = typer.main.get_command(app)
    sections = dict(re.findall(r"^## `upholster (\w+)`\n(.*?)(?=^## |\Z)", made, re.M | re.S))
    assert list(sections) == list(group.commands)
    for name, command in group.commands.items():
        for option in (p for p in command.params if p.param_type_name == "option" and not p.hidden):
            row = "| " + ", ".join(f"`{spelled}`" for spelled in [*option.opts, *option.secondary_opts])
            assert sections[name].count(f"\n{row} ") == 1, (name, row)
        rows = [line for line in sections[name].splitlines() if line.startswith("| `")]
        assert {_cells(row) for row in rows} <= {2}, name


def _cells(row: str) -> int:
    return len(re.findall(r"(?<!\\)\|", row)) - 1


def test_the_reference_has_every_public_name_once() -> None:
    import upholster

    made: str = runpy.run_path(str(ROOT / "docs" / "site_tools" / "reference.py"))["markdown"]()
    listed = re.findall(r"^\.\. auto\w+:: upholster\.(\w+)$", made, re.MULTILINE)
    public = {name for name in upholster.__all__ if not name.startswith("__")}
    assert sorted(listed) == sorted(public - {"measure"})
    measures = re.findall(r"^\.\. auto\w+:: upholster\.measure\.(\w+)$", made, re.MULTILINE)
    assert sorted(measures) == sorted(name for name in upholster.covering.measure.__all__)
