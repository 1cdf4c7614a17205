"""The order of tasks: charts class after class, each tile as soon as all charts that it shows are laid."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from time import monotonic
from typing import Any

from upholster._version import __version__
from upholster.errors import InputError, StoppedError

Progressing = object
joined = lambda x: None
from upholster.parallel import TaskPool
from upholster.quilt.model import Quilt
from upholster.tiles.chart_files import read_chart, read_part
from upholster.tiles.places import Place
from upholster.tiles.work import (
    TileWork,
    laid_name,
    lay_chart_task,
    paint_tiles_task,
    part_name,
    quilt_of,
    state_name,
    store,
    store_state,
)
from upholster.types import Progress

__all__ = ["laid_by_tasks", "write_tiles"]

_RECORD = "record.json"
_CHARTS_FIRST, _TILES_LATER = 1, 0
"""Priorities: other charts wait for charts, and nobody waits for a tile."""

_MOST_TILES = 4
"""In one task: a task costs Dask about as much whatever it does."""

_RECORD_EVERY = 1.0
"""Seconds between two times that the record is written."""

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
) -> Quilt:
    """Lay all charts, as `write_tiles` does, and return the quilt."""
    run = _Running(work, folder, pool, progress)
    run.begin(tell)
    with run.told():
        run.lay()
    charts = range(len(work.run.charts))
    found = quilt_of(work, charts, [read_chart(folder.read(laid_name(n))) for n in charts])
    folder.remove_all()
    return found


class _Running:
    """A run: what is done, and which tiles wait for which charts."""

    def __init__(self, work: TileWork, folder: Place, pool: TaskPool, progress: Progress | None) -> None:
        self.work, self.folder, self.pool, self.progress = work, folder, pool, progress
        pages = 0 if work.atlas is None else len(work.atlas.layout.pages)
        self.waiting = {page: work.atlas.shown_on(page) for page in range(pages)} if work.atlas else {}
        self.ready: list[int] = []
        self.painting: dict[int, tuple[int, ...]] = {}
        self.width, self.busy = 1, 0
        self.tiles, self.placements = pages, 0
        self.done: dict[str, Any] = {"charts": {}, "tiles": {}}
        self.stored, self.noted = "", 0.0

    @contextmanager
    def told(self) -> Iterator[None]:
        """Say what is done when Ctrl-C stops what is done within; note it whatever stops that."""
        try:
            yield
        except KeyboardInterrupt:
            raise StoppedError(f"stopped; {self._so_far()}; the same command goes on there") from None
        finally:
            with suppress(InputError):  # of a full disk, which is told already
                self._note()

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
        for n, sizes in known["charts"].items():
            if _is_there(self.folder, _chart_files(int(n)), sizes):
                self.done["charts"][n] = sizes
        for page, sizes in known["tiles"].items():
            if _is_there(self.work.output, self.work.tile_files(int(page)), sizes):
                self.done["tiles"][page] = sizes
                del self.waiting[int(page)]

    def lay(self) -> None:
        """Lay the charts, class after class; tiles are painted meanwhile where a worker is free."""
        run, so_far = self.work.run, Progressing.of(self.work.run)
        for number, members in enumerate(run.classes):
            self.width = self.pool.width
            todo = [n for n in members if str(n) not in self.done["charts"]]
            if todo:
                store_state(self.folder, number, so_far)
            # The largest first: what comes last shall not keep one worker long while others wait.
            for n in sorted(todo, key=lambda n: -run.charts[n].height * run.charts[n].width):
                self._submit(("chart", n), lay_chart_task, n, number, priority=_CHARTS_FIRST)
            for n in members:
                if str(n) in self.done["charts"]:
                    self._laid(n)
            self._paint()
            while any(str(n) not in self.done["charts"] for n in members):
                self._next()
            self.folder.remove(state_name(number))
            parts = [read_part(self.folder.read(part_name(n))) for n in members]
            self.placements += sum(part.placements for part in parts)
            so_far.enter(members, [replace(part, overhang=_NO_OVERHANG) for part in parts])

    def finish(self) -> dict[str, int]:
        """Wait for the last tiles; return the bytes of all files."""
        while len(self.done["tiles"]) < self.tiles:
            self._next()
        return {
            self.work.output.file(name): size
            for page in range(self.tiles)
            for name, size in self.done["tiles"][str(page)].items()
        }

    def _submit(self, key: tuple[str, int], task: Callable[..., Any], *arguments: Any, priority: int) -> None:
        self.busy += 1
        self.pool.submit(key, task, self.folder.folder, self.stored, *arguments, priority=priority)

    def _next(self) -> None:
        """Wait for a task, note what came of it, and start what has waited for it."""
        kind, number = self.pool.next()
        self.busy -= 1
        if kind == "chart":
            self.done["charts"][str(number)] = _sizes(self.folder, _chart_files(number))
            self._laid(number)
        else:
            for page in self.painting.pop(number):
                self.done["tiles"][str(page)] = _sizes(self.work.output, self.work.tile_files(page))
            self._report("paint", len(self.done["tiles"]), self.tiles)
        if monotonic() - self.noted > _RECORD_EVERY:
            self._note()
        self._paint()

    def _laid(self, n: int) -> None:
        """Find the tiles that have waited for a chart alone."""
        self._report("blocks", len(self.done["charts"]), len(self.work.run.charts))
        for page in [page for page, charts in self.waiting.items() if n in charts]:
            self.waiting[page].discard(n)
            if not self.waiting[page]:
                del self.waiting[page]
                self.ready.append(page)

    def _paint(self) -> None:
        """Start painting tiles that are ready: several in a task, and fewer the fewer are left.

        Tasks that become smaller towards the end: Polychronopoulos, Kuck: Guided self-scheduling, 1987.
        """
        while self.ready and len(self.painting) < 2 * self.width:
            left = len(self.ready) + len(self.waiting)
            share = min(_MOST_TILES, max(1, left // (2 * self.width)))
            if len(self.ready) < share and self.busy > self.width:
                return  # there is enough to do, and more will come
            pages, self.ready = tuple(self.ready[:share]), self.ready[share:]
            self.painting[pages[0]] = pages
            self._submit(("tile", pages[0]), paint_tiles_task, pages, priority=_TILES_LATER)

    def _report(self, stage: str, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(stage, done, total)

    def _note(self) -> None:
        self.folder.write(_RECORD, json.dumps(self.done).encode())
        self.noted = monotonic()


def _chart_files(n: int) -> tuple[str, str]:
    return laid_name(n), part_name(n)


def _sizes(place: Place, names: Iterable[str]) -> dict[str, int]:
    """Return the bytes of files by name."""
    return {name: place.size(name) for name in names}


def _is_there(place: Place, names: Iterable[str], sizes: object) -> bool:
    """Return whether files are there, and of these bytes."""
    found = _sizes(place, names)
    return found == sizes and -1 not in found.values()
