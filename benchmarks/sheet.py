"""A revision of git and this checkout side by side: 24 cases, their measures and their pictures.

``python -m benchmarks sheet REV [--data FOLDER] [-o OUT] [--cache FOLDER] [--only CASE …] [--seed N]``

Both run by their commands; both are measured, and drawn, by this checkout, from their files alone. OUT gets
pages of pictures (sheet_1.jpg …), sheet.md and sheet.csv, and the tree's results. What REV wrote is kept in
the cache, by its commit, so a second call runs the tree alone. A figure that is worse in the tree by more
than noise has a "!"; of two equal versions none has, but for times, which another program may disturb.
"""

import argparse
import csv
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.sheet_cases import CASES, Case, make_inputs, places
from benchmarks.sheet_measures import MEASURES, Figures, measure
from benchmarks.sheet_pages import Drawn, draw, nothing, write_pages
from benchmarks.sheet_run import Made, Side, revision, working_tree

__all__ = ["main", "options"]

PROCESSES = 2


def options() -> argparse.ArgumentParser:
    """Return the program's options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks sheet", description=__doc__)
    parser.add_argument("revision", metavar="REV", help="what the tree is compared with: HEAD, main~3")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="has textures/, models/, materials/")
    parser.add_argument("-o", "--out", type=Path, default=Path("sheet"), help="default: sheet")
    cache = Path(tempfile.gettempdir()) / "upholster-sheet"
    parser.add_argument("--cache", type=Path, default=cache, help=f"default: {cache}")
    parser.add_argument(
        "--only", nargs="+", default=(), metavar="CASE", choices=[case.name for case in CASES]
    )
    parser.add_argument("--seed", type=int, default=1)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program; status 1 if a case of the tree failed, which ran before."""
    parser = options()
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    try:
        sides = (revision(asked.revision, asked.cache), working_tree(asked.out))
        for side in sides:
            side.check()
    except (ValueError, RuntimeError) as error:
        parser.error(str(error))
    made = asked.cache / "inputs"
    make_inputs(made)
    where, missing = places(CASES, made, asked.data)
    chosen = [case for case in CASES if not asked.only or case.name in asked.only]
    for case in chosen:
        if case.name in missing:
            print(f"{case.name} is skipped: {missing[case.name]}", file=sys.stderr)
    chosen = [case for case in chosen if case.name not in missing]
    return _compare(chosen, sides, where, asked.out, asked.seed)


def _compare(
    cases: Sequence[Case], sides: tuple[Side, Side], where: dict[str, Path], out: Path, seed: int
) -> int:
    runs: list[tuple[Case, Made]] = []
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        for case in cases:
            runs += [(case, side.run(case, where, seed)) for side in sides]
            times = ["failed" if made.failed else f"{made.seconds:.1f} s" for _, made in runs[-2:]]
            print(f"{case.name}: {' -> '.join(times)}", file=sys.stderr, flush=True)
        # Nothing else runs while the commands are timed.
        looked = list(pool.map(partial(_look, where), runs))
    figures = {case.name: (looked[2 * n][0], looked[2 * n + 1][0]) for n, case in enumerate(cases)}
    drawn = {case.name: (looked[2 * n][1], looked[2 * n + 1][1]) for n, case in enumerate(cases)}
    names = (sides[0].name, sides[1].name)
    lines = {name: [_caption(side) for side in both] for name, both in figures.items()}
    pages = write_pages(out, drawn, names, lines)
    _write(out, figures, drawn, names)
    _show(figures, names)
    print(f"wrote {', '.join(str(page) for page in pages)}, sheet.md, sheet.csv", file=sys.stderr)
    failed = [name for name, (before, after) in drawn.items() if after.failed and not before.failed]
    for name, both in drawn.items():
        for side, of in zip(both, names, strict=True):
            if side.failed:
                print(f"{name} failed in {of}: {side.failed}", file=sys.stderr)
    return int(bool(failed))


def _look(where: dict[str, Path], run: tuple[Case, Made]) -> tuple[Figures, Drawn]:
    case, made = run
    if made.failed:
        return {}, nothing(made.failed)
    try:
        found = measure(case, made.result(case), where)
        drawn = draw(case, made.result(case))
    except Exception as error:  # what a version wrote may be anything: the other cases count
        return {}, nothing(f"{type(error).__name__}: {error}")
    found |= {"seconds": made.seconds, "processor": made.processor}
    return found | ({"stream": float(made.stream)} if made.stream else {}), drawn


def _caption(found: Figures) -> list[str]:
    first = [
        f"{name} {MEASURES[name].form.format(found[name])}"
        for name in ("seam", "wrap", "swd", "patches")
        if name in found
    ]
    second = [
        f"{name} {MEASURES[name].form.format(found[name])}"
        for name in ("size", "direction", "broken")
        if name in found
    ]
    return [", ".join(first), ", ".join(second)]


def _cell(name: str, before: Figures, after: Figures) -> str:
    """Return "before → after", with a mark where that is worse; one figure where both are equal."""
    if name not in before and name not in after:
        return ""
    form = MEASURES[name].form
    one, other = (form.format(side[name]) if name in side else "none" for side in (before, after))
    mark = " !" if _worse(name, before, after) else ""
    return one if one == other else f"{one} → {other}{mark}"


def _worse(name: str, before: Figures, after: Figures) -> bool:
    if name in before and name in after:
        return MEASURES[name].worse(before[name], after[name])
    return name in before and not after


def _write(
    out: Path,
    figures: dict[str, tuple[Figures, Figures]],
    drawn: dict[str, tuple[Drawn, Drawn]],
    names: tuple[str, str],
) -> None:
    text = [
        f"{names[0]} → {names[1]}; ! is worse by more than noise",
        "",
        f"| case | {' | '.join(MEASURES)} |",
    ]
    text.append("| --- " * (len(MEASURES) + 1) + "|")
    with (out / "sheet.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["case", "measure", *names, "worse", "failed"])
        for case, both in figures.items():
            text.append(f"| {case} | {' | '.join(_cell(name, *both) for name in MEASURES)} |")
            failed = " ".join(side.failed for side in drawn[case])
            for name in MEASURES:
                if name in both[0] or name in both[1]:
                    values = [side.get(name, "") for side in both]
                    writer.writerow([case, name, *values, "!" * _worse(name, *both), failed.strip()])
    (out / "sheet.md").write_text("\n".join(text) + "\n", encoding="utf-8")


def _show(figures: dict[str, tuple[Figures, Figures]], names: tuple[str, str]) -> None:
    """Print the table in two parts, and how many figures of each measure are worse."""
    halves = list(MEASURES)[:7], list(MEASURES)[7:]
    console = Console(width=170)
    for half in halves:
        table = Table(f"{names[0]} → {names[1]}", *half)
        for case, both in figures.items():
            table.add_row(case, *(_cell(name, *both) for name in half))
        table.add_section()
        worse = [sum(_worse(name, *both) for both in figures.values()) for name in half]
        table.add_row("worse", *(str(count) for count in worse))
        console.print(table)


if __name__ == "__main__":
    sys.exit(main())
