"""Commands that the documents show, as the tests run them."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

from command_line import Done, run_cli

__all__ = ["PATIENCE", "run_shown", "small"]

PATIENCE = 900
"""Seconds after which a command hangs: the machine may be busy, and kernels not compiled yet."""

PROGRAMS = """
upholster() { PYTHON -m upholster "$@"; }
python() { PYTHON "$@"; }
""".replace("PYTHON", shlex.quote(sys.executable))
"""What a reader's shell has in its environment: the program that is tested, and its Python."""


def small(command: str) -> str:
    """Return a command at few texels: tests ask whether it runs, not how long it takes."""
    few = re.sub(r"--texels \d+M", "--texels 200k", command)
    if re.match(r"(upholster|\S*/upholster) cover", few) and not re.search(
        "--texels|--method paper|--project", few
    ):
        command, mark, comment = few.partition("  #")
        few = f"{command.rstrip()} --texels 200k{mark}{comment}"
    return few


def run_shown(command: str, folder: Path) -> None:
    """Run a command as a reader does who is in a folder, at few texels; it must end with status 0.

    What needs no shell runs in this process: to start another and to load kernels takes seconds, each time.
    `warm` has its own process, because `run_cli` compiles nothing.
    """
    command = small(command)
    words = shlex.split(command, comments=True)
    if words[0] == "upholster" and words[1] != "warm" and not _needs_shell(command):
        done = run_cli(*words[1:], cwd=folder)
    else:
        ran = subprocess.run(
            ["bash", "-eo", "pipefail", "-c", PROGRAMS + command],
            cwd=folder, capture_output=True, text=True, timeout=PATIENCE,
        )  # fmt: skip
        done = Done(ran.returncode, ran.stdout, ran.stderr)
    assert done.returncode == 0, f"$ {command}\n{done.stdout}{done.stderr}"


def _needs_shell(command: str) -> bool:
    """Whether a command has more than words: pipes, files for its output, patterns of names, variables."""
    return bool(re.search(r"[|<>;&$*?~{`\\]", re.sub(r"'[^']*'|\s#.*", "", command)))
