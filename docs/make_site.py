"""Build the documentation as a site: ``python docs/make_site.py [FOLDER]``.

FOLDER is ``build/site`` by default; ``docs/index.html`` in it is the first page, and ``index.html`` leads
there. A link that leads nowhere, within the project, is an error, and so is whatever else Sphinx warns of.
Needs the extra "docs". Neither building nor reading takes a network.
"""

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MARK = ".buildinfo"
"""Sphinx leaves this file in each site that it builds."""


def main(arguments: list[str]) -> int:
    """Build the site; return 0, 1 where something in it is wrong, or 2 where it was not begun."""
    if len(arguments) > 1 or any(word.startswith("-") for word in arguments):
        return _refused(f"arguments are {' '.join(arguments)!r}; allowed: one folder")
    if find_spec("sphinx") is None:
        return _refused("Sphinx is missing; pip install -e '.[docs]'")
    folder = Path(arguments[0] if arguments else ROOT / "build" / "site").resolve()
    if folder.exists():
        if not folder.is_dir() or (any(folder.iterdir()) and not (folder / MARK).is_file()):
            return _refused(f"{folder} holds other things than a site; a new or an empty folder is allowed")
        shutil.rmtree(folder)  # else pages that are no more would stay
    doctrees = ROOT / "build" / "site.doctrees"
    words = ["-b", "html", "-q", "-E", "-W", "--keep-going", "-j", "auto", "-c", str(ROOT / "docs")]
    command = [sys.executable, "-m", "sphinx", *words, "-d", str(doctrees), str(ROOT), str(folder)]
    status = subprocess.call(command)
    if status == 0:
        print(f"the site is {folder / 'index.html'}")
    return 1 if status else 0


def _refused(told: str) -> int:
    print(f"make_site: {told}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
