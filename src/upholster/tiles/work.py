"""What one task does: lay a chart, or paint a tile. It finds all that it needs in the work's folder."""

import hashlib
import io
import pickle
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from upholster._version import __version__
from upholster.errors import InputError
from upholster.export import map_companion, page_files
from upholster.geometry import Surface

Labelled = labelled = object
Progressing = QuiltRun = lay_one = object
from upholster.options import WriteOptions
from upholster.paging import PagedAtlas, write_page
from upholster.quilt.materials import WindowPainter
from upholster.quilt.model import Quilt
from upholster.quilt.painting import painted_charts
from upholster.tiles.chart_files import (
    chart_bytes,
    part_bytes,
    read_chart,
    read_part,
    read_state,
    state_bytes,
)
from upholster.tiles.places import Place
from upholster.types import PixelArray, frozen_array

__all__ = [
    "TileWork",
    "laid_name",
    "lay_chart_task",
    "paint_tiles_task",
    "part_name",
    "quilt_of",
    "state_name",
    "store",
    "store_state",
    "tile_work",
]

_RUN = "run"


@dataclass(frozen=True, eq=False)
class TileWork:
    """All that stays the same while charts are laid and tiles are painted.

    Attributes
    ----------
    run
        What charts are laid by.
    shape
        (height, width) of the sample.
    surface
        What they lie on.
    atlas
        The tiles; None where there are none.
    maps
        What is painted, by role, the base colour first.
    files
        Names of the tiles, by role.
    output
        Where tiles are written.
    quality
        Of JPEG and WebP.
    """

    run: QuiltRun
    shape: tuple[int, int]
    surface: Surface
    atlas: PagedAtlas | None
    maps: Mapping[str, PixelArray]
    files: Mapping[str, Sequence[str]]
    output: Place
    quality: int = 90

    def key(self) -> str:
        """Return a hash of all that tells what the tiles will be, and of the version."""
        layout = None if self.atlas is None else self.atlas.layout
        parts = (__version__, self.run, self.shape, layout, dict(self.maps), dict(self.files))
        found = hashlib.sha256()
        _feed(found, (*parts, self.quality))
        return found.hexdigest()

    def tile_files(self, page: int) -> list[str]:
        """Return the names of a tile's files, of each map one."""
        return [names[page] for names in self.files.values()]


def tile_work(
    run: QuiltRun,
    surface: Surface,
    shape: tuple[int, int],
    maps: Mapping[str, PixelArray],
    target: str | None,
    output: Place,
    options: WriteOptions,
) -> TileWork:
    """Return the work of laying all charts, and of painting their tiles.

    Parameters
    ----------
    run, surface, shape
        As of `TileWork`.
    maps
        What is painted, by role.
    target
        The name of the base colour's tiles, with ``<UDIM>``; None: nothing is painted.
    output
        Where tiles are written.
    options
        How.

    Raises
    ------
    InputError
        If charts and tiles do not fit.
    """
    if target is None:
        return TileWork(run, shape, surface, None, {}, {}, output)
    atlas = PagedAtlas.of(surface, painted_charts(run.charts, run.density), options)
    names = {role: target if role == "albedo" else map_companion(target, role) for role in maps}
    files = {
        role: [file.name for file in page_files(name, len(atlas.layout.pages))]
        for role, name in names.items()
    }
    return TileWork(run, shape, surface, atlas, maps, files, output, options.quality)


def store(place: Place, work: TileWork) -> str:
    """Write the work for the tasks; return the hash of what was written, which they compare."""
    out = io.BytesIO()
    _Pickler(out, protocol=pickle.HIGHEST_PROTOCOL).dump(work)
    data = out.getvalue()
    place.write(_RUN, data)
    return _short_hash(data)


def _short_hash(data: bytes) -> str:
    """Return what tells two runs apart: each task's message has it."""
    return hashlib.sha256(data).hexdigest()[:16]


class _Pickler(pickle.Pickler):
    """Keeps read-only arrays read-only: kernels are compiled for either kind apart."""

    def reducer_override(self, value: Any) -> Any:
        if type(value) is np.ndarray and not value.flags.writeable:
            return frozen_array, (value.copy(),)
        return NotImplemented


@lru_cache(maxsize=1)
def load(place: Place, stored: str) -> TileWork:
    """Return the work that lies in a folder, if it is that of a hash; a process keeps the last one.

    Raises
    ------
    InputError
        If it is another.
    """
    data = place.read(_RUN)
    if _short_hash(data) != stored:
        raise InputError(f"{place.file(_RUN)!r} is of another run; allowed: one run at a time in a folder")
    work: TileWork = pickle.loads(data)
    return work


def store_state(place: Place, number: int, so_far: Progressing) -> None:
    """Write what the charts of a class of that number are told of all before it, but for the overhangs."""
    place.write(state_name(number), state_bytes(so_far.usage, so_far.shown))


@lru_cache(maxsize=1)
def _state(place: Place, stored: str, number: int) -> Progressing:
    count = len(load(place, stored).run.charts)
    usage, shown = read_state(place.read(state_name(number)), count)
    return Progressing([None] * count, shown, usage)


def lay_chart_task(folder: str, stored: str, n: int, number: int) -> None:
    """Lay a chart of the class of that number, and write what comes of it."""
    place = Place(folder)
    run, state = load(place, stored).run, _state(place, stored, number)
    needed = run.transfer.asked_of(n).intersection(run.before(number))
    overhangs = [
        read_part(place.read(part_name(k))).overhang if k in needed else None for k in range(len(run.charts))
    ]
    laid, part = lay_one(run, n, number, Progressing(overhangs, state.shown, state.usage))
    shape = load(place, stored).shape
    own = labelled(n, run.charts[n], run.fields[n], shape, laid, cell=LABEL_CELL)
    place.write(laid_name(n), chart_bytes(own))
    place.write(part_name(n), part_bytes(replace(part, placements=len(own[0]))))


def paint_tiles_task(folder: str, stored: str, pages: Sequence[int]) -> None:
    """Paint and write tiles of every map, one after the other."""
    place = Place(folder)
    work = load(place, stored)
    atlas = work.atlas
    assert atlas is not None  # there are tiles
    shown = sorted(set[int]().union(*(atlas.shown_on(page) for page in pages)))
    quilt = quilt_of(work, shown, [read_chart(place.read(laid_name(n))) for n in shown])
    for role, image in work.maps.items():
        painter = _Painter(shown, WindowPainter(quilt, role, image))
        for page in pages:
            pixels = atlas.painted(page, role, painter)
            with work.output.writing(work.files[role][page]) as path:
                write_page(path, role, pixels, quality=work.quality)


class _Painter(NamedTuple):
    """Paints windows of charts by their numbers in the whole layout: a quilt has some of them alone."""

    shown: Sequence[int]
    painter: WindowPainter

    def __call__(self, index: int, window: tuple[slice, slice] | None = None, /) -> PixelArray:
        return self.painter.paint(self.shown.index(index), window)


def quilt_of(work: TileWork, charts: Sequence[int], own: Sequence[Labelled]) -> Quilt:
    """Return the quilt of some of the charts alone, in that order."""
    placed = [part.copy() for part, _ in own]
    for number, part in enumerate(placed):
        part["chart"] = number
    return Quilt(
        tuple(work.run.charts[n] for n in charts),
        work.shape,
        np.concatenate(placed),
        tuple((layer,) for _, layer in own),
        tuple(work.run.fields[n] for n in charts),
        density=work.run.density,
    )


def laid_name(n: int) -> str:
    """Return the name of the file with placements and labels of a chart."""
    return f"chart-{n}"


def part_name(n: int) -> str:
    """Return the name of the file with what a chart leaves to others."""
    return f"overhang-{n}"


def state_name(number: int) -> str:
    """Return the name of the file with what a class of charts is told of those before it."""
    return f"class-{number}"


def _feed(found: Any, value: Any) -> None:
    """Put a value into a hash, whatever it is made of."""
    if isinstance(value, np.ndarray):
        found.update(f"{value.dtype.str}{value.shape}".encode())
        found.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value):
        found.update(type(value).__name__.encode())
        for entry in fields(value):
            _feed(found, getattr(value, entry.name))
    elif isinstance(value, (list, tuple)):
        found.update(f"({len(value)}".encode())
        for one in value:
            _feed(found, one)
    elif isinstance(value, Mapping):
        _feed(found, [(key, value[key]) for key in sorted(value, key=repr)])
    elif isinstance(value, AbstractSet):
        _feed(found, sorted(value, key=repr))
    else:
        assert value is None or isinstance(value, (bool, int, float, str, np.generic)), type(value)
        found.update(repr(value).encode() + b",")
