"""Run a benchmark: ``python -m benchmarks NAME [FOLDER|FILE …] [-o OUT] [--publish]``, and its options.

Each prints its table; with ``--publish`` this becomes a table of docs/benchmarks.md (`benchmarks.tables`).
Without a folder, samples are the project's own. ``eye`` and ``sheet``, which compare two versions of the
program, and ``eye_samples`` have their own options: ``python -m benchmarks eye --help``.
"""

import argparse
import importlib
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table as Shown

from benchmarks.measure import Request
from benchmarks.tables import Table, write_table

TABLES = {
    "cad": "cad",
    "codec": "",
    "fidelity": "fidelity",
    "fill": "fill",
    "guides": "guides",
    "lattices": "lattices",
    "meshes": "meshes",
    "meshstream": "",
    "prefixes": "prefixes",
    "quilt": "time",
    "seams": "seams",
    "stream": "streams",
    "web_peers": "web",
}
"""Each module, and the table of docs/benchmarks.md that its rows are as they are, if any."""

PROGRAMS = ("eye", "eye_samples", "sheet")


def main() -> int:
    """Run, print, publish."""
    if sys.argv[1:2] and sys.argv[1] in PROGRAMS:
        return int(importlib.import_module(f"benchmarks.{sys.argv[1]}").main(sys.argv[2:]))
    shape = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__, formatter_class=shape)
    parser.add_argument("name", choices=[*TABLES, *PROGRAMS])
    parser.add_argument("files", nargs="*", type=Path, metavar="FOLDER|FILE")
    parser.add_argument("-o", "--out", type=Path, help="a folder for pictures and points")
    parser.add_argument("--texels", type=int)
    parser.add_argument("--seeds", type=int, default=Request.seeds, help="default 1")
    parser.add_argument("--runs", type=int, default=Request.runs, help="of browsers; default 5")
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    given = parser.parse_args()
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
    request = Request(tuple(given.files), given.out, given.texels, given.seeds, given.runs)
    table: Table = importlib.import_module(f"benchmarks.{given.name}").measured(request)
    shown = Shown(*table.columns)
    for row in table.rows:
        shown.add_row(*row)
    Console(width=140).print(shown)
    if given.publish and TABLES[given.name]:
        words = ["FOLDER" if Path(word) in request.files else word for word in sys.argv[1:]]
        print(write_table(TABLES[given.name], table, f"python -m benchmarks {' '.join(words)}"))
    return 0


sys.exit(main())
