"""Functions of all commands: one-line errors, numbers and sizes as users write them, progress bars."""

import math
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upholster.base.errors import FormatError, InputError, printable

if TYPE_CHECKING:  # NumPy, which it imports, would slow down --help
    from rich.console import Console
    from rich.progress import Progress as Bars
    from rich.table import Table

    from upholster.base.limits import Limits
    from upholster.base.types import Progress
    from upholster.runtime.warm import Compiler

__all__ = [
    "EVERY",
    "MostTexels",
    "Quiet",
    "Threads",
    "add_row",
    "bars",
    "byte_count",
    "check_suffix",
    "compiled",
    "large_count",
    "limits_of",
    "naming",
    "new_console",
    "noted",
    "numbers",
    "progress_bars",
    "say",
    "share",
    "texel_count",
    "view_angles",
]

MostTexels = Annotated[
    str | None,
    typer.Option(
        "--limit", metavar="4M", help="Refuse a stream with more texels; other limits follow from it."
    ),
]
"""The option that `limits_of` reads."""

Threads = Annotated[int | None, typer.Option(help="Threads, 1 to 256; default: one per core.")]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]

EVERY = 10.0
"""Seconds between two lines of progress if the output is not a terminal."""

_COMPILING = "compiling kernels, once for this machine and version: {} of {}"


def check_suffix(name: str, path: str, suffixes: Sequence[str]) -> None:
    """Raise InputError unless a file's name ends in one of some suffixes."""
    if not path.lower().endswith(tuple(suffixes)):
        suffix = os.path.splitext(path)[1]
        raise InputError(f"{name} {path!r} has suffix {suffix!r}; allowed: {', '.join(suffixes)}")


def numbers(
    name: str, text: str, separator: str, count: int, kind: Callable[[str], Any], *, other: str = ""
) -> Any:
    """Read `count` numbers separated by `separator`; `other` names the other allowed values."""
    parts = text.lower().split(separator)
    try:
        found = tuple(kind(part) for part in parts)
    except ValueError:
        found = ()
    if len(found) != count:
        form = separator.join(["N"] * count)
        raise InputError(f"{name} is {text!r}; allowed: {count} numbers as {form}{other}")
    return found


def view_angles(text: str) -> tuple[float, float]:
    """Read ``--view``: azimuth and elevation in degrees, ``30,30``."""
    other = " (azimuth, elevation)"
    if text.strip().lower() == "sheet":
        other += "; `sheet`, four sides in one picture, is for `upholster picture model.glb --view sheet`"
    found: tuple[float, float] = numbers("view", text, ",", 2, float, other=other)
    return found


def new_console(*, stderr: bool = False) -> "Console":
    """Return a rich console; if NO_COLOR is set, one without colours, bold or dim words."""
    from rich.console import Console

    return Console(stderr=stderr, color_system=None if os.environ.get("NO_COLOR") else "auto")


def say(line: str, *, error: bool = False) -> None:
    """Print a line on stdout, or stderr, without interpreting markup in names of files."""
    print(printable(line), file=sys.stderr if error else sys.stdout, flush=True)


def add_row(table: "Table", *cells: str) -> None:
    """Add a row to a table without interpreting markup."""
    from rich.text import Text

    table.add_row(*(Text(printable(cell)) for cell in cells))


@contextmanager
def noted() -> Iterator[list[str]]:
    """Yield a list for notes from readers of images, and print them on stderr at the end."""
    notes: list[str] = []
    yield notes
    for note in notes:
        say(f"note: {note}", error=True)


def byte_count(name: str, text: str | None) -> int | None:
    """Read a number of bytes: ``4000``, ``4k`` (thousands), ``4Ki`` (1024), ``1.5M``."""
    if text is None:
        return None
    found = re.fullmatch(r"([0-9]{1,12}(?:\.[0-9]{1,6})?)(k|M|Ki|Mi)?B?", text.strip())
    if found is None:
        raise InputError(f"{name} is {text!r}; allowed: a number of bytes such as 4000, 4k, 4Ki or 1.5M")
    unit = {None: 1, "k": 1000, "M": 10**6, "Ki": 1024, "Mi": 1024**2}[found[2]]
    return int(float(found[1]) * unit)


def texel_count(text: str | None) -> int | tuple[int, int] | None:
    """Read a number of texels, ``4M`` or ``500k``, or the width and height of a flat texture, ``512x512``."""
    if text is None:
        return None
    found = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", text.strip().lower())
    if found is not None:
        return int(found[1]), int(found[2])
    return large_count("texels", text, other=", or a size such as 512x512")


def limits_of(text: str | None) -> "Limits | None":
    """Read ``--limit``: the largest number of texels of a stream, ``4M``; the other limits follow from it."""
    from upholster.base.limits import Limits

    return None if text is None else Limits(texels=large_count("limit", text))


def large_count(name: str, text: str, *, other: str = "") -> int:
    """Read a number such as ``4M`` or ``500k``; `other` names the other allowed values."""
    found = re.fullmatch(r"([0-9]{1,10}(?:\.[0-9]{1,6})?)(k|m|g)?", text.strip().lower())
    if found is None:
        raise InputError(f"{name} is {text!r}; allowed: a number such as 500k or 4M{other}")
    return int(float(found[1]) * {None: 1, "k": 1000, "m": 10**6, "g": 10**9}[found[2]])


def share(name: str, text: str | None) -> float | None:
    """Read a share above 0 and at most 1: ``5%`` or ``0.05``."""
    if text is None:
        return None
    try:
        value = float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except ValueError:
        value = math.nan
    if not 0 < value <= 1:
        raise InputError(f"{name} is {text!r}; allowed: a share such as 5% or 0.05, above 0 and at most 100%")
    return value


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Add the file's name to format errors in a block."""
    try:
        yield
    except FormatError as error:
        raise FormatError(f"{file}: {error}") from None


@contextmanager
def progress_bars(quiet: bool, uses: Iterable[str] = ()) -> "Iterator[Progress | None]":
    """Show one bar per stage on stderr; meanwhile compile the kernels of some uses, and report that.

    `uses` are those in the table of kernels, see `upholster.runtime.warm`.
    """
    from upholster.runtime.warm import compiling

    with compiling(uses) as compiler, bars(quiet, compiler) as report:
        yield report


def compiled(uses: Iterable[str], quiet: bool) -> None:
    """Compile the kernels of some uses, and wait: otherwise each worker would compile them."""
    from upholster.runtime.warm import compiling

    with compiling(uses) as compiler, bars(quiet, compiler):
        if compiler is not None:
            compiler.wait()


@contextmanager
def bars(quiet: bool, compiler: "Compiler | None") -> "Iterator[Progress | None]":
    """Show one bar per stage on stderr, and a compiler's progress; lines in a log; nothing if `quiet`."""
    if quiet:
        yield None
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console = new_console(stderr=True)
    if not console.is_terminal:
        with _lines(console, compiler) as report_lines:
            yield report_lines
        return
    columns = (TextColumn("{task.description:>7}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Bars(*columns, console=console, transient=True) as shown:
        if compiler is not None:
            _follow(compiler, shown)
        tasks: dict[str, Any] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = shown.add_task(stage)  # without a total, the bar moves but shows no share
            if total == 1 and not done:
                return
            shown.update(tasks[stage], completed=done, total=total)

        yield report


@contextmanager
def _lines(console: "Console", compiler: "Compiler | None") -> "Iterator[Progress]":
    """Print lines, as for a log: that kernels are being compiled, and every few seconds the progress."""
    stage, start, ended = "starting", time.perf_counter(), threading.Event()

    def say(text: str) -> None:
        with suppress(OSError):  # a full log does not stop the work
            console.print(text, style="dim", highlight=False, soft_wrap=True)

    def print_lines() -> None:
        # Bad options and files are found within a second: then their message is the only line.
        pause = 1.0
        while not ended.wait(pause):
            if compiler is not None and compiler.running:
                say(_COMPILING.format(compiler.done, compiler.total))
            elif pause == EVERY:
                say(f"{stage}, {time.perf_counter() - start:.0f} s")
            pause = EVERY

    def report(name: str, done: int, total: int) -> None:
        nonlocal stage  # the unit may be blocks, charts, or texels of several materials
        stage = f"{name} {100 * done // max(1, total)} %" if total > 1 else name

    threading.Thread(target=print_lines, daemon=True).start()
    try:
        yield report
    finally:
        ended.set()


def _follow(compiler: "Compiler", shown: "Bars") -> None:
    task = shown.add_task("", total=compiler.total)

    def follow() -> None:
        while compiler.running:
            text = _COMPILING.format(compiler.done, compiler.total)
            shown.update(task, completed=compiler.done, description=text)
            time.sleep(0.2)
        shown.remove_task(task)

    threading.Thread(target=follow, daemon=True).start()
