"""The sources of the package, parsed once for all tests that read them."""

import ast
from functools import cache
from pathlib import Path

SOURCES = Path(__file__).parent.parent / "src"
Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def trees() -> dict[str, ast.Module]:
    """Return each module by its path below the package."""
    package = SOURCES / "upholster"
    files = sorted(package.rglob("*.py"))
    return {
        file.relative_to(package).as_posix(): ast.parse(file.read_text(encoding="utf-8")) for file in files
    }


@cache
def definitions() -> list[tuple[str, ast.ClassDef | Function]]:
    """Return all classes and functions with their names, "path: name"."""
    return [
        (f"{path}: {node.name}", node)
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef | Function)
    ]
