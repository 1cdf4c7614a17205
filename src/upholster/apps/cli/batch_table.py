"""Progress of a batch: a live table on a terminal, lines in a log."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from upholster.apps.cli.console import EVERY, new_console, say
from upholster.base.errors import printable

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["shown"]

_LAST = 8
"""Number of recently ended jobs in the table."""

Show = Callable[[str, Mapping[str, Any]], None]


class _Tally:
    """Counts of ended jobs."""

    def __init__(self, total: int) -> None:
        self.total, self.done, self.failed, self.texels = total, 0, 0, 0
        self.start = time.perf_counter()
        self.last: deque[tuple[str, str, str]] = deque(maxlen=_LAST)

    def add(self, name: str, entry: Mapping[str, Any]) -> None:
        good = entry["state"] == "done"
        self.done += good
        self.failed += not good
        self.texels += entry.get("texels", 0)
        words = f"{entry['texels']:,} texels" if good else entry["error"]
        self.last.append((name, f"{entry.get('seconds', 0):.1f} s", words))

    def line(self) -> str:
        ended = self.done + self.failed
        seconds = time.perf_counter() - self.start
        rate = self.texels / seconds / 1e6
        line = f"{ended:,} of {self.total:,} jobs, {self.failed:,} failed, {rate:.2f} Mtexels/s"
        return f"{line}, {_clock((self.total - ended) * seconds / ended)} left" if ended else line

    def table(self) -> "Table":
        from rich.box import SIMPLE_HEAD
        from rich.table import Table
        from rich.text import Text

        table = Table(
            "job", "time", "", box=SIMPLE_HEAD, title=Text(self.line()), title_justify="left", expand=True
        )
        for row in self.last:
            table.add_row(*(Text(printable(cell), no_wrap=True, overflow="ellipsis") for cell in row))
        return table


@contextmanager
def shown(total: int, dashboard: str, quiet: bool) -> Iterator[Show]:
    """Show the progress of a batch of `total` jobs; failed jobs are reported even if `quiet`.

    Yields a function that takes the name of an ended job, and its entry in the record.
    """
    from rich.live import Live

    tally = _Tally(total)
    console = new_console(stderr=True)
    if dashboard and not quiet:
        say(f"dashboard: {dashboard}", error=True)
    if console.is_terminal and not quiet:
        with Live(tally.table(), console=console, transient=True, refresh_per_second=4) as live:

            def update(name: str, entry: Mapping[str, Any]) -> None:
                tally.add(name, entry)
                live.update(tally.table())
                if entry["state"] != "done":
                    live.console.print(printable(_failure(name, entry)), markup=False, highlight=False)

            yield update
        return
    printed = time.perf_counter()

    def add(name: str, entry: Mapping[str, Any]) -> None:
        nonlocal printed
        tally.add(name, entry)
        if entry["state"] != "done":
            say(_failure(name, entry), error=True)
        if not quiet and time.perf_counter() - printed > EVERY:
            printed = time.perf_counter()
            say(tally.line(), error=True)

    yield add


def _failure(name: str, entry: Mapping[str, Any]) -> str:
    return f"failed: {name}: {entry['error']}"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return (
        f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s" if minutes else f"{rest} s"
    )
