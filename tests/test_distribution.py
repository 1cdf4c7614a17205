"""What is told of the project beside its code agrees: version, address, versions of Python."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import upholster

ROOT = Path(__file__).parent.parent
WORKFLOWS = ROOT / ".github" / "workflows"


@pytest.fixture(scope="module")
def project() -> Any:
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def _citation(key: str) -> str | None:
    """Return a value at the top of CITATION.cff."""
    found = re.search(rf"^{key}: *(.+)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)
    return found[1].strip("\"'") if found else None


def test_the_citation_is_of_this_version(project: Any) -> None:
    assert _citation("version") == upholster.__version__
    assert _citation("title") == project["name"]
    assert _citation("license") == project["license"]


def test_the_address_is_the_same_wherever_it_stands(project: Any) -> None:
    """It is filled in in pyproject.toml; until it is, nobody else tells one."""
    urls = project.get("urls", {})
    address = urls.get("Repository")
    assert _citation("repository-code") == address
    reported = json.loads((ROOT / "web" / "package.json").read_text("utf-8")).get("repository")
    if address is None:
        assert (urls, reported) == ({}, None)
        return
    assert set(urls) == {"Repository", "Documentation", "Changelog", "Issues"}
    assert "OWNER" not in "".join(urls.values())
    # The npm package names no host: it has the short form, `github:owner/name`.
    assert reported["url"].partition(":")[2] == "/".join(address.split("/")[-2:])
    assert reported["directory"] == "web"


def test_the_oldest_and_the_newest_python_that_are_named_are_tested(project: Any) -> None:
    reported = [line.rpartition(" ")[2] for line in project["classifiers"] if re.search(r":: 3\.\d+$", line)]
    assert reported == [f"3.{minor}" for minor in range(11, 11 + len(reported))]
    assert project["requires-python"] == f">={reported[0]}"
    tested = re.search(r"^ +python: \[(.*)\]$", (WORKFLOWS / "tests.yml").read_text("utf-8"), re.MULTILINE)
    assert tested
    assert re.findall(r"[\d.]+", tested[1]) == [reported[0], reported[-1]]
    page = (ROOT / "docs" / "versions.md").read_text("utf-8")
    assert f"Python {reported[0]} to {reported[-1]}" in page
