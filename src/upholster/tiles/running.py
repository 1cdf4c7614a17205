"""The order of tasks: charts class after class, each tile as soon as all charts that it shows are laid."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

from upholster._version import __version__
from upholster.errors import StoppedError
from upholster.methods.quilt.run import Progressing
from upholster.methods.quilt.transfer import ChartPlacements, joined
from upholster.parallel import TaskPool
from upholster.tiles.chart_files import read_laid, read_part
from upholster.tiles.places import Place
from upholster.tiles.work import (
    TileWork,
    laid_name,
    lay_chart_task,
    paint_tile_task,
    part_name,
    state_name,
    store,
    store_state,
)
from upholster.types import Progress

__all__ = ["laid_by_tasks", "write_tiles"]

_RECORD = "record.json"
_CHARTS_FIRST, _TILES_LATER = 1, 0
"""Priorities: other charts wait for charts, and nobody waits for a tile."""

_NO_OVERHANG = joined(())
"""What is entered here in place of an overhang: whoever needs one reads it for himself."""


def write_tiles(
    work: TileWork,
    folder: Place,
    pool: TaskPool,
    *,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
) -> tuple[dict[str, int], int]:
    """Lay all charts and write all tiles; what an interrupted run has done is not done again.

    Parameters
    ----------
    work
        What is done.
    folder
        Where tasks put what they leave to others; it is removed at the end.
    pool
        Runs the tasks.
    progress
        Called with the stages "blocks", charts, and "paint", tiles.
    tell
        Called with a line for people if a run goes on.

    Returns
    -------
    tuple
        Bytes of each file, and how many placements there are.

    Raises
    ------
    InputError
        If something cannot be read or written. What is done stays, and the next run goes on there.
    StoppedError
        After Ctrl-C; the same.
    """
    run = _Running(work, folder, pool, progress)
    run.begin(tell)
    with run.told():
        run.lay()
        written = run.finish()
    folder.remove_all()
    return written, run.placements


def laid_by_tasks(
    work: TileWork,
    folder: Place,
    pool: TaskPool,
    *,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
) -> list[ChartPlacements]:
    """Lay all charts, as `write_tiles` does, and return each one's placements."""
    run = _Running(work, folder, pool, progress)
    run.begin(tell)
    with run.told():
        run.lay()
    found = [read_laid(folder.read(laid_name(n))) for n in range(len(work.run.charts))]
    folder.remove_all()
    return found


class _Running:
    """A run: what is done, and which tiles wait for which charts."""

    def __init__(self, work: TileWork, folder: Place, pool: TaskPool, progress: Progress | None) -> None:
        self.work, self.folder, self.pool, self.progress = work, folder, pool, progress
        pages = 0 if work.layout is None else len(work.layout.pages)
        self.waiting = {page: work.shown_on(page) for page in range(pages)}
        self.tiles = pages
        self.done: dict[str, Any] = {"charts": {}, "tiles": {}}
        self.stored = ""

    @property
    def placements(self) -> int:
        """How many there are on the charts that are done."""
        return sum(count for count, *_ in self.done["charts"].values())

    @contextmanager
    def told(self) -> Iterator[None]:
        """Say what is done when Ctrl-C stops what is done within."""
        try:
            yield
        except KeyboardInterrupt:
            raise StoppedError(f"stopped; {self._so_far()}; the same command goes on there") from None

    def _so_far(self) -> str:
        charts = f"{len(self.done['charts'])} of {len(self.work.run.charts)} charts"
        return f"{charts} and {len(self.done['tiles'])} of {self.tiles} tiles are done"

    def begin(self, tell: Callable[[str], None] | None) -> None:
        """Find what is done already, if the folder is that of a run of the same, and make it ready."""
        key = self.work.key()
        if _RECORD in self.folder.names():
            known = self._known()
            if known.get("key") == key:
                self._go_on(known)
                if tell is not None:
                    tell(f"goes on: {self._so_far()}")
            else:
                self.folder.remove_all()
        self.folder.make()
        self.done = {"upholster": __version__, "key": key, **self.done}
        self._note()
        self.stored = store(self.folder, self.work)

    def _known(self) -> dict[str, Any]:
        """Return what the record has; nothing if it is broken."""
        with suppress(ValueError):
            found = json.loads(self.folder.read(_RECORD))
            if isinstance(found, dict):
                return found
        return {}

    def _go_on(self, known: dict[str, Any]) -> None:
        """Take over what the record has, as far as the files are there."""
        for n, told in known["charts"].items():
            files = laid_name(int(n)), part_name(int(n))
            if all(self.folder.size(name) == size for name, size in zip(files, told[1:], strict=True)):
                self.done["charts"][n] = told
        for page, files in known["tiles"].items():
            if all(self.work.output.size(name) == size for name, size in files.items()):
                self.done["tiles"][page] = files
                del self.waiting[int(page)]

    def lay(self) -> None:
        """Lay the charts, class after class; tiles are painted meanwhile where a worker is free."""
        run, so_far = self.work.run, Progressing.of(self.work.run)
        for number, members in enumerate(run.classes):
            todo = [n for n in members if str(n) not in self.done["charts"]]
            if todo:
                store_state(self.folder, number, so_far)
            left = set(todo)
            for n in todo:
                self._submit(("chart", n), lay_chart_task, n, number, priority=_CHARTS_FIRST)
            for n in members:
                if n not in left:
                    self._laid(n)
            while left:
                left.discard(self._next())
            self.folder.remove(state_name(number))
            parts = [read_part(self.folder.read(part_name(n))) for n in members]
            so_far.enter(members, [replace(part, overhang=_NO_OVERHANG) for part in parts])

    def finish(self) -> dict[str, int]:
        """Wait for the last tiles; return the bytes of all files."""
        while len(self.done["tiles"]) < self.tiles:
            self._next()
        return {
            self.work.output.file(name): size
            for page in sorted(self.done["tiles"], key=int)
            for name, size in self.done["tiles"][page].items()
        }

    def _submit(self, key: tuple[str, int], task: Callable[..., Any], *arguments: int, priority: int) -> None:
        self.pool.submit(key, task, self.folder, self.stored, *arguments, priority=priority)

    def _next(self) -> int:
        """Wait for a task, note what came of it, and return the chart that it laid; −1 for a tile."""
        (kind, number), found = self.pool.next()
        self.done["charts" if kind == "chart" else "tiles"][str(number)] = found
        self._note()
        if kind == "chart":
            self._laid(number)
            return number
        self._report("paint", len(self.done["tiles"]), self.tiles)
        return -1

    def _laid(self, n: int) -> None:
        """Start the tiles that have waited for a chart."""
        self._report("blocks", len(self.done["charts"]), len(self.work.run.charts))
        for page in [page for page, charts in self.waiting.items() if n in charts]:
            self.waiting[page].discard(n)
            if not self.waiting[page]:
                del self.waiting[page]
                self._submit(("tile", page), paint_tile_task, page, priority=_TILES_LATER)

    def _report(self, stage: str, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(stage, done, total)

    def _note(self) -> None:
        self.folder.write(_RECORD, json.dumps(self.done).encode())
