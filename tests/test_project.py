"""The project holds itself to its rules: functions one can read, papers that are true. Linters: `.ci/run`."""

import ast
import json
import re
from pathlib import Path

from benchmarks.tables import read_tables
from benchmarks.web_peers import PLAYERS, RATES
from sources import SOURCES, Function, definitions

import upholster

ROOT = Path(__file__).parent.parent
MOST_LINES = 100
"""Of a function, its signature included and its docstring not: about forty are usual."""
MOST_PARAMETERS = 8
"""Of a function, ``self`` not counted."""
MANY_PARAMETERS = {
    "pipeline.py: cover": "public: keywords with defaults, as the README shows them",
    "output/output_writer.py: write": "public: keywords with defaults",
    "output/refinement.py: refine": "public: keywords with defaults",
    "codec/stream/writer.py: encode_stream": "public: keywords with defaults",
    "model/render/picture.py: render": "a scene and its view: keywords with defaults",
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
        name
        for name in many
        if name.partition(":")[0].endswith("_kernels.py") or name.startswith("apps/cli/")
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
    rows = read_tables()["web"].rows
    assert [tuple(row[:2]) for row in rows] == [(rate, player) for rate in RATES for player in PLAYERS]
    for rate in RATES:  # the least of each column is bold, whoever has it
        for column in zip(*(row[2:5] for row in rows if row[0] == rate), strict=True):
            assert min(map(_seconds, column)) == _seconds(next(cell for cell in column if "**" in cell))
    peers = json.loads((ROOT / "benchmarks" / "peers" / "package.json").read_text(encoding="utf-8"))
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in peers["dependencies"].values())


def _seconds(cell: str) -> float:
    return float(cell.strip(" *s"))


def test_the_changelog_knows_the_version() -> None:
    assert f"## {upholster.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_kernels_live_in_modules_of_their_own() -> None:
    for path in SOURCES.rglob("*.py"):
        if "kernels" not in path.name and path.name != "jit.py":
            assert "@kernel" not in path.read_text(encoding="utf-8"), path


def test_only_a_kernel_that_is_called_imports_numba() -> None:
    """`jit` does so when a kernel is called, and it alone imports the other three, or `warm` does."""
    users = ("inlined_code", "kernel_cache", "signatures")
    for path in SOURCES.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if path.stem not in users:
            assert not re.search(r"^(import|from) (numba|llvmlite)", text, re.MULTILINE), path
            assert not re.search(rf"^from upholster.({'|'.join(users)}) ", text, re.MULTILINE), path
