"""Tables of docs/benchmarks.md, made of benchmarks/results: ``python -m benchmarks.tables [--check]``.

A table is a CSV file with the columns that the page shows. Lines before them begin with "# ". They give the
date, the revision, the command, and the versions of other programs. The page has a pair of marks for each
file, ``<!-- table: NAME -->`` and ``<!-- end of table -->``; the command writes the table between them.
Benchmarks write their files when they are called with ``--publish``. Figures that were measured before there
were such files were entered by hand; their revision is the one that they were measured with.
"""

import argparse
import csv
import datetime
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["PAGE", "RESULTS", "Table", "main", "page", "read_table", "read_tables", "write_table"]

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "benchmarks.md"
RESULTS = Path(__file__).parent / "results"
HEAD = ("measured", "revision", "command", "peers", "note")
"""What the lines before the columns may say, in this order. The last two may be missing."""

MARKS = re.compile(
    r"(?<=<!-- table: )(?P<name>[\w-]+)(?P<open> -->\n).*?(?=<!-- end of table -->\n)", re.DOTALL
)


@dataclass(frozen=True)
class Table:
    """A table as its file holds it.

    Attributes
    ----------
    columns, rows
        Texts, as shown; every row has as many as there are columns.
    head
        What the lines before them say, by the names of `HEAD`.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    head: dict[str, str] = field(default_factory=dict)

    def markdown(self) -> str:
        """Return the table in Markdown, and the line that says how it was measured, with its end of line."""
        lines = [self.columns, ("---",) * len(self.columns), *self.rows]
        shown = [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines]
        about = (
            f"Measured {self.head['measured']}, revision {self.head['revision']}: `{self.head['command']}`"
        )
        about += f"; {self.head['peers']}." if self.head.get("peers") else "."
        if self.head.get("note"):
            about += f" {self.head['note']}"
        return "\n".join([*shown, "", about, ""])


def read_table(path: Path) -> Table:
    """Read a file of results.

    Raises
    ------
    ValueError
        If its head or a row is not as it should be; the message names the file.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    missing = [name for name in HEAD[:3] if name not in head]
    unknown = [name for name in head if name not in HEAD]
    if missing or unknown:
        fault = f"lacks {missing[0]!r}" if missing else f"has an unknown line {unknown[0]!r}"
        raise ValueError(f"{path.name}: its head {fault}; it may have: {', '.join(HEAD)}")
    columns, *rows = csv.reader(line for line in lines if not line.startswith("# "))
    for number, row in enumerate(rows, 1):
        if len(row) != len(columns):
            raise ValueError(f"{path.name}: row {number} has {len(row)} cells, not {len(columns)}")
    return Table(tuple(columns), tuple(tuple(row) for row in rows), head)


def read_tables(folder: Path = RESULTS) -> dict[str, Table]:
    """Return all tables of a folder by the names of their files."""
    return {path.stem: read_table(path) for path in sorted(folder.glob("*.csv"))}


def write_table(name: str, table: Table, command: str, folder: Path = RESULTS) -> Path:
    """Write a table that was measured today, by the program as its last commit left it; return the file.

    Parameters
    ----------
    name
        Of the table: the file is ``NAME.csv``.
    table
        Its head may have "peers", other programs with their versions, and a "note".
    command
        What to type to measure the same again.
    folder
        Where to.
    """
    revision = subprocess.run(
        ["git", "log", "-1", "--format=%h", "--", "src"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()
    today = datetime.date.today()
    measured = {"measured": f"{today.day} {today:%B %Y}", "revision": revision, "command": command}
    head = {key: (measured | table.head).get(key, "") for key in HEAD}
    path = folder / f"{name}.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in head.items() if value)
        csv.writer(file, lineterminator="\n").writerows([table.columns, *table.rows])
    return path


def page(text: str, tables: dict[str, Table]) -> str:
    """Return the page with the tables in their places.

    Raises
    ------
    ValueError
        If the page asks for a table that there is not, or does not show one exactly once.
    """
    places = [match["name"] for match in MARKS.finditer(text)]
    for name in {*places, *tables}:
        if name not in tables:
            raise ValueError(f"there is no benchmarks/results/{name}.csv; there are: {', '.join(tables)}")
        if places.count(name) != 1:
            raise ValueError(f"{PAGE.name} shows the table {name!r} {places.count(name)} times, not once")
    return MARKS.sub(lambda match: f"{match['name']}{match['open']}{tables[match['name']].markdown()}", text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; with ``--check`` only say whether it is up to date, by status 1 if it is not."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tables", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing")
    asked = parser.parse_args(arguments)
    old = PAGE.read_text(encoding="utf-8")
    try:
        new = page(old, read_tables())
    except ValueError as error:
        print(f"benchmarks.tables: {error}", file=sys.stderr)
        return 2
    if asked.check:
        return int(new != old)
    PAGE.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
