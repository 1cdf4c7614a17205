"""Commands that the documents show, as the tests run them."""

import re

__all__ = ["small"]


def small(command: str) -> str:
    """Return a command at few texels: tests ask whether it runs, not how long it takes."""
    few = re.sub(r"--texels \d+M", "--texels 200k", command)
    if re.match(r"(upholster|\S*/upholster) cover", few) and not re.search(
        "--texels|--method paper|--project", few
    ):
        command, mark, comment = few.partition("  #")
        few = f"{command.rstrip()} --texels 200k{mark}{comment}"
    return few
