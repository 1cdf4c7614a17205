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
    """Return a command at few texels and pixels: tests ask whether it runs, not how long it takes."""
    few, mark, comment = re.sub(r"--texels \d+M", "--texels 200k", command).partition("  #")
    few = few.rstrip()
    name = re.match(r"(?:\S*/)?upholster (\w+)", few)
    if name and name[1] == "cover" and not re.search("--texels|--method paper|--project", few):
        few += " --texels 200k"
    if name and name[1] in ("cover", "refine") and not re.search(r"--size |--texels \d+x", few):
        few += " --size 240x180" if re.search(r"-o \w+\.png", few) else ""
    return few + mark + comment


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
