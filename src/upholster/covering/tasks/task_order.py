"""The order of tasks: each as soon as its inputs are ready."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from time import monotonic
from typing import Any

from upholster._version import __version__
from upholster.base.errors import InputError, StoppedError
from upholster.covering.tasks.storage import Place
from upholster.covering.tasks.task_files import read_chart
from upholster.covering.tasks.work import (
    TileWork,
    join_task,
    label_task,
    lay_task,
    paint_tiles_task,
    quilt_of,
    store,
)
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import TaskPool, report_note, report_progress

__all__ = ["laid_by_tasks", "write_tiles"]

_RECORD = "record.json"
_KINDS = ("parcel", "label", "chart", "tile")
_PARCELS_FIRST, _LABELS_NEXT, _TILES_LATER = 2, 1, 0
"""Priorities: most tasks wait for parcels, charts and tiles wait for labels, and none waits for a tile."""

_MOST_TILES = 4
"""The most tiles in one task: Dask's overhead per task does not depend on its work."""

_RECORD_EVERY = 1.0
"""Seconds between two writes of the record."""


def write_tiles(work: TileWork, folder: Place, pool: TaskPool) -> tuple[dict[str, int], int]:
    """Lay all blocks and write all tiles; work finished by an interrupted run is not repeated.

    Progress has the stages "blocks", parcels, and "paint", tiles.

    Parameters
    ----------
    work
        The work to do.
    folder
        The folder for data between tasks; it is removed at the end.
    pool
        Runs the tasks.

    Returns
    -------
    tuple
        Bytes of each file, and the number of placements.

    Raises
    ------
    InputError
        If a file cannot be read or written. Finished work is kept, and the next run continues from it.
    StoppedError
        After Ctrl-C, likewise.
    """
    run = _Running(work, folder, pool)
    run.begin()
    with run.recorded():
        run.lay()
        written = run.finish()
    placed = run.placements()
    folder.remove_all()
    return written, placed


def laid_by_tasks(work: TileWork, folder: Place, pool: TaskPool) -> Quilt:
    """Lay all blocks, as `write_tiles` does, and return the quilt."""
    run = _Running(work, folder, pool)
    run.begin()
    with run.recorded():
        run.lay()
        run.finish()
    charts = range(len(work.plan.scene.charts))
    found = quilt_of(work, charts, [read_chart(folder.read(f"chart-{n}")) for n in charts])
    folder.remove_all()
    return found


class _Running:
    """A run: finished tasks, and the dependencies of the others.

    A parcel waits for its earlier neighbours, its labels wait for all of them, a chart for its parcels'
    labels, and a tile for the charts that it shows.
    """

    def __init__(self, work: TileWork, folder: Place, pool: TaskPool) -> None:
        self.work, self.folder, self.pool = work, folder, pool
        parcels = work.plan.parcels
        self.tiles = 0 if work.atlas is None else len(work.atlas.layout.pages)
        self.unlaid = {n: set(parcels.near(n)) for n in range(len(parcels))}
        self.earlier = {n: {k for k in near if k < n} for n, near in self.unlaid.items()}
        self.missing_parcels = {n: set(of) for n, of in enumerate(work.parcels_of)}
        self.waiting = {page: work.atlas.shown_on(page) for page in range(self.tiles)} if work.atlas else {}
        self.ready: list[int] = []
        self.painting: dict[int, tuple[int, ...]] = {}
        self.width, self.busy = 1, 0
        self.done: dict[str, Any] = {kind: {} for kind in _KINDS}
        self.stored, self.noted = "", 0.0

    @contextmanager
    def recorded(self) -> Iterator[None]:
        """Write the record however the body ends; if Ctrl-C ends it, report the finished work."""
        try:
            yield
        except KeyboardInterrupt:
            raise StoppedError(f"stopped; {self._so_far()}; run the same command to continue") from None
        finally:
            with suppress(InputError):  # of a full disk, which is already reported
                self._note()

    def _so_far(self) -> str:
        counts = {
            "parcel": len(self.work.plan.parcels),
            "chart": len(self.work.parcels_of),
            "tile": self.tiles,
        }
        parts = [f"{len(self.done[kind])} of {count} {kind}s" for kind, count in counts.items()]
        return f"{parts[0]}, {parts[1]} and {parts[2]} are done"

    def begin(self) -> None:
        """Find finished work, if the folder is from a run of the same, and prepare the folder."""
        key = self.work.key()
        known: dict[str, Any] = {}
        if _RECORD in self.folder.names():
            known = self._known()
            if known.get("key") == key:
                self._go_on(known)
                report_note(f"continuing: {self._so_far()}")
            else:
                self.folder.remove_all()
        self.folder.make()
        self.done = {"upholster": __version__, "key": key, **self.done}
        self._note()
        self.stored = store(self.folder, self.work)

    def _known(self) -> dict[str, Any]:
        """Return the content of the record; nothing if it is broken."""
        with suppress(ValueError):
            found = json.loads(self.folder.read(_RECORD))
            if isinstance(found, dict):
                return found
        return {}

    def _go_on(self, known: dict[str, Any]) -> None:
        """Take over the finished tasks of the record whose files exist."""
        for kind in _KINDS:
            for n, sizes in known[kind].items():
                if _is_there(*self._files(kind, int(n)), sizes):
                    self.done[kind][n] = sizes

    def _files(self, kind: str, n: int) -> tuple[Place, list[str]]:
        """Return the folder and the names of a task's files."""
        work = self.work
        names = {
            "parcel": work.parcel_files,
            "label": work.label_files,
            "chart": work.chart_files,
            "tile": work.tile_files,
        }
        return work.output if kind == "tile" else self.folder, names[kind](n)

    def lay(self) -> None:
        """Lay the parcels; free workers do all other tasks that are ready."""
        for page in [int(page) for page in self.done["tile"]]:
            del self.waiting[page]
        self._find_charts([n for n, parcels in self.missing_parcels.items() if not parcels])
        self._start([n for n, earlier in self.earlier.items() if not earlier])
        self._paint()
        while len(self.done["parcel"]) < len(self.unlaid):
            self._next()

    def _start(self, parcels: list[int]) -> None:
        """Lay parcels whose earlier neighbours are laid."""
        while parcels:
            n = parcels.pop(0)
            if self._is_done("parcel", n):
                parcels += self._laid(n)
            else:
                self._submit(("parcel", n), lay_task, n, priority=_PARCELS_FIRST)

    def finish(self) -> dict[str, int]:
        """Wait for all charts and tiles; return the bytes of the tiles' files."""
        while len(self.done["chart"]) < len(self.missing_parcels) or len(self.done["tile"]) < self.tiles:
            self._next()
        return {
            self.work.output.file(name): size
            for page in range(self.tiles)
            for name, size in self.done["tile"][str(page)].items()
        }

    def placements(self) -> int:
        """Return the number of placements of all charts."""
        return sum(int(self.folder.read(f"count-{n}")) for n in self.missing_parcels)

    def _is_done(self, kind: str, n: int) -> bool:
        return str(n) in self.done[kind]

    def _submit(self, key: tuple[str, int], task: Callable[..., Any], *arguments: Any, priority: int) -> None:
        self.busy += 1
        self.pool.submit(key, task, self.folder.folder, self.stored, *arguments, priority=priority)

    def _next(self) -> None:
        """Wait for a task, record its result, and start tasks that only waited for it."""
        kind, number = self.pool.next()
        self.busy -= 1
        self.width = self.pool.width
        for n in self.painting.pop(number) if kind == "tile" else (number,):
            self.done[kind][str(n)] = _sizes(*self._files(kind, n))
        if kind == "parcel":
            self._start(self._laid(number))
        elif kind == "label":
            self._labelled(number)
        elif kind == "chart":
            self._shown(number)
        else:
            report_progress("paint", len(self.done["tile"]), self.tiles)
        if monotonic() - self.noted > _RECORD_EVERY:
            self._note()
        self._paint()

    def _laid(self, n: int) -> list[int]:
        """Compute the labels that only waited for this parcel; return the parcels that can start."""
        report_progress("blocks", len(self.done["parcel"]), len(self.unlaid))
        found = []
        for k in self.work.plan.parcels.near(n):
            if k > n:
                self.earlier[k].discard(n)
                if not self.earlier[k]:
                    found.append(k)
            self.unlaid[k].discard(n)
            if self.unlaid[k]:
                continue
            if self._is_done("label", k):
                self._labelled(k)
            else:
                self._submit(("label", k), label_task, k, priority=_LABELS_NEXT)
        return found

    def _labelled(self, n: int) -> None:
        """Assemble charts that only waited for the labels of this parcel."""
        for chart in self.work.plan.parcels.charts[n]:
            self.missing_parcels[chart].discard(n)
        self._find_charts([n for n in self.work.plan.parcels.charts[n] if not self.missing_parcels[n]])

    def _find_charts(self, charts: Iterable[int]) -> None:
        for n in charts:
            if len(self.work.parcels_of[n]) == 1:  # already written by its parcel's task
                self.done["chart"][str(n)] = _sizes(*self._files("chart", n))
            if self._is_done("chart", n):
                self._shown(n)
            else:
                self._submit(("chart", n), join_task, n, priority=_LABELS_NEXT)

    def _shown(self, n: int) -> None:
        """Find the tiles that only waited for this chart."""
        for page in [page for page, charts in self.waiting.items() if n in charts]:
            self.waiting[page].discard(n)
            if not self.waiting[page]:
                del self.waiting[page]
                self.ready.append(page)

    def _paint(self) -> None:
        """Start painting tiles that are ready: several per task, and fewer as fewer are left.

        Tasks that become smaller towards the end: Polychronopoulos, Kuck: Guided self-scheduling, 1987.
        """
        while self.ready and len(self.painting) < 2 * self.width:
            left = len(self.ready) + len(self.waiting)
            share = min(_MOST_TILES, max(1, left // (2 * self.width)))
            if len(self.ready) < share and self.busy > self.width:
                return  # the workers have enough tasks, and more tiles will be ready
            pages, self.ready = tuple(self.ready[:share]), self.ready[share:]
            self.painting[pages[0]] = pages
            self._submit(("tile", pages[0]), paint_tiles_task, pages, priority=_TILES_LATER)

    def _note(self) -> None:
        self.folder.write(_RECORD, json.dumps(self.done).encode())
        self.noted = monotonic()


def _sizes(place: Place, names: Iterable[str]) -> dict[str, int]:
    """Return the bytes of files by name."""
    return {name: place.size(name) for name in names}


def _is_there(place: Place, names: Iterable[str], sizes: object) -> bool:
    """Return whether files exist and have these sizes."""
    found = _sizes(place, names)
    return found == sizes and -1 not in found.values()
