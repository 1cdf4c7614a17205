"""The project holds itself to its rules: functions one can read, papers that are true. Linters: `.ci/run`."""

import ast
import json
import re
from pathlib import Path

from benchmarks.web_peers import MARKS, PLAYERS, RATES
from sources import SOURCES, Function, definitions

import upholster

ROOT = Path(__file__).parent.parent
MOST_LINES = 100
"""Of a function, its signature included and its docstring not: about forty are usual."""
MOST_PARAMETERS = 8
"""Of a function, ``self`` not counted."""
MANY_PARAMETERS = {
    "pipeline.py: cover": "public: keywords with defaults, as the README shows them",
    "writing.py: write": "public: keywords with defaults",
    "refining.py: refine": "public: keywords with defaults",
    "stream/writer.py: encode_stream": "public: keywords with defaults",
    "image/material_files.py: read_material": "public: keywords with defaults, as `read_exemplar`",
    "render/picture.py: render": "a scene and its view: keywords with defaults",
}
"""Functions that take more, and why."""


def _functions() -> list[tuple[str, Function]]:
    """Return each function and method and its name, "path: name"."""
    return [(name, node) for name, node in definitions() if isinstance(node, Function)]


def _length(function: Function) -> int:
    """Return the lines of a function without its docstring."""
    documented = ast.get_docstring(function, clean=False) is not None
    return _lines(function) - (_lines(function.body[0]) if documented else 0)


def _parameters(function: Function) -> int:
    named = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return sum(parameter.arg not in ("self", "cls") for parameter in named)


def _lines(node: ast.stmt) -> int:
    assert node.end_lineno is not None
    return node.end_lineno - node.lineno + 1


def test_every_function_can_be_read() -> None:
    functions = list(_functions())
    assert len(functions) > 500
    assert not [name for name, function in functions if _length(function) > MOST_LINES]


def test_functions_have_few_parameters() -> None:
    """But kernels, whose modules end in ``_kernels``, and commands, whose parameters are options."""
    many = {name for name, function in _functions() if _parameters(function) > MOST_PARAMETERS}
    exempt = {
        name for name in many if name.partition(":")[0].endswith("_kernels.py") or name.startswith("cli/")
    }
    assert many - exempt == set(MANY_PARAMETERS)


def test_ci_runs_the_readmes_test_command() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    commands = re.findall(r"^```sh\n(.*?)\n```", readme, re.MULTILINE | re.DOTALL)
    assert "upholster cover" in commands[0]
    assert "pytest" in commands[1]
    assert commands[1] in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_papers_link_to_files_that_exist() -> None:
    archive = (ROOT / "PKG-INFO").exists()  # a source archive has no pictures
    for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "web" / "README.md"):
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if not (archive and link.endswith((".jpg", ".png"))):
                assert (page.parent / link).exists(), f"{page} links to {link}"


def test_the_published_comparison_has_every_viewer_on_every_line() -> None:
    page = (ROOT / "docs" / "web.md").read_text(encoding="utf-8")
    table = page.partition(MARKS[0])[2].partition(MARKS[1])[0]
    wanted = [[rate, player] for rate in RATES for player in PLAYERS]
    rows = [row.strip("|").split("|") for row in table.splitlines() if row.startswith("|")][2:]
    assert [[cell.strip() for cell in row[:2]] for row in rows] == wanted
    for rate in RATES:  # the least of each column is bold, whoever has it
        for column in zip(*(row[2:5] for row in rows if row[0].strip() == rate), strict=True):
            assert min(map(_seconds, column)) == _seconds(next(cell for cell in column if "**" in cell))
    peers = json.loads((ROOT / "benchmarks" / "peers" / "package.json").read_text(encoding="utf-8"))
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in peers["dependencies"].values())


def _seconds(cell: str) -> float:
    return float(cell.strip(" *s"))


def test_the_changelog_knows_the_version() -> None:
    assert f"## {upholster.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_kernels_live_in_modules_of_their_own() -> None:
    for path in SOURCES.rglob("*.py"):
        if "kernels" not in path.name and path.name not in ("jit.py", "kernel_cache.py"):
            text = path.read_text(encoding="utf-8")
            assert "@kernel" not in text, path
            assert "import numba" not in text, path
