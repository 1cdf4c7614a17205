"""The content of one task: lay a parcel, label it, join a chart, paint tiles, with data from a folder."""

import hashlib
import io
import pickle
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from upholster._version import __version__
from upholster.base.errors import InputError
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray, frozen_array
from upholster.covering.tasks.storage import Place
from upholster.covering.tasks.task_files import (
    blocks_bytes,
    chart_bytes,
    piece_bytes,
    read_blocks,
    read_chart,
    read_piece,
)
from upholster.geometry.patches.surface import Surface
from upholster.output.atlas_pages import PagedAtlas, write_page
from upholster.output.export.map_files import map_companion
from upholster.output.export.pages import page_files
from upholster.quilt.materials import WindowPainter
from upholster.quilt.model import Quilt
from upholster.synthesis.quilt.emit import Labelled, LabelPiece, label_pieces, labelled
from upholster.synthesis.quilt.laid_blocks import ParcelBlocks
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.laying import draw_parcel, lay_parcel

__all__ = [
    "TileWork",
    "join_task",
    "label_task",
    "lay_task",
    "paint_tiles_task",
    "quilt_of",
    "store",
    "tile_work",
]

_RUN = "run"


@dataclass(frozen=True, eq=False)
class TileWork:
    """Everything that stays the same while blocks are laid and tiles are painted.

    Attributes
    ----------
    plan
        The plan by which blocks are laid.
    atlas
        The tiles; None if there are none.
    maps
        The maps to paint, by role, the base colour first.
    files
        Names of the tiles, by role.
    output
        Where tiles are written.
    quality
        Quality of JPEG and WebP.
    """

    plan: LayPlan
    atlas: PagedAtlas | None
    maps: Mapping[str, PixelArray]
    files: Mapping[str, Sequence[str]]
    output: Place
    quality: int = 90

    @cached_property
    def parcels_of(self) -> tuple[tuple[int, ...], ...]:
        """For each chart the parcels that may contain part of it."""
        found: list[list[int]] = [[] for _ in self.plan.scene.charts]
        for parcel, charts in enumerate(self.plan.parcels.charts):
            for chart in charts:
                found[chart].append(parcel)
        return tuple(map(tuple, found))

    def parcel_files(self, n: int) -> list[str]:
        """Return the names of the files from laying a parcel."""
        return [f"parcel-{n}"]

    def label_files(self, n: int) -> list[str]:
        """Return the names of the files from labelling a parcel: charts inside it, and pieces of others."""
        names = []
        for chart in self.plan.parcels.charts[n]:
            alone = len(self.parcels_of[chart]) == 1
            names += self.chart_files(chart) if alone else [piece_name(chart, n)]
        return names

    def chart_files(self, n: int) -> list[str]:
        """Return the names of a chart's files: placements and labels, and the number of placements."""
        return [f"chart-{n}", f"count-{n}"]

    def key(self) -> str:
        """Return a hash of everything that affects the tiles, and of the version."""
        layout = None if self.atlas is None else self.atlas.layout
        parts = (__version__, self.plan, layout, dict(self.maps), dict(self.files))
        found = hashlib.sha256()
        _feed(found, (*parts, self.quality))
        return found.hexdigest()

    def tile_files(self, page: int) -> list[str]:
        """Return the names of a tile's files, one per map."""
        return [names[page] for names in self.files.values()]


def tile_work(
    plan: LayPlan,
    tiles: tuple[Surface, str] | None,
    maps: Mapping[str, PixelArray],
    output: Place,
    options: WriteOptions,
) -> TileWork:
    """Return the work of laying all blocks, and of painting tiles.

    Parameters
    ----------
    plan
        As for `TileWork`.
    tiles
        The surface that they cover, and the name of the base colour's tiles, with ``<UDIM>``; None: nothing
        is painted.
    maps
        The maps to paint, by role.
    output
        Where tiles are written.
    options
        Format options of the tiles.

    Raises
    ------
    InputError
        If charts and tiles do not match.
    """
    if tiles is None:
        return TileWork(plan, None, {}, {}, output)
    surface, target = tiles
    atlas = PagedAtlas.of(surface, plan.scene.painted, options)
    names = {role: target if role == "albedo" else map_companion(target, role) for role in maps}
    files = {
        role: [file.name for file in page_files(name, len(atlas.layout.pages))]
        for role, name in names.items()
    }
    return TileWork(plan, atlas, maps, files, output, options.quality)


def store(place: Place, work: TileWork) -> str:
    """Write the work for the tasks; return the hash of the file, which they compare."""
    out = io.BytesIO()
    _Pickler(out, protocol=pickle.HIGHEST_PROTOCOL).dump(work)
    data = out.getvalue()
    place.write(_RUN, data)
    return _short_hash(data)


def _short_hash(data: bytes) -> str:
    """Return a hash that distinguishes runs; it is short because each task's message contains it."""
    return hashlib.sha256(data).hexdigest()[:16]


class _Pickler(pickle.Pickler):
    """Keeps read-only arrays read-only, because kernels are compiled separately for each kind."""

    def reducer_override(self, value: Any) -> Any:
        if type(value) is np.ndarray and not value.flags.writeable:
            return frozen_array, (value.copy(),)
        return NotImplemented


@lru_cache(maxsize=1)
def load(place: Place, stored: str) -> TileWork:
    """Return the work in a folder, if it has this hash; a process keeps the last one.

    Raises
    ------
    InputError
        If it has another hash.
    """
    data = place.read(_RUN)
    if _short_hash(data) != stored:
        raise InputError(f"{place.file(_RUN)!r} is of another run; allowed: one run at a time in a folder")
    work: TileWork = pickle.loads(data)
    return work


def lay_task(folder: str, stored: str, n: int) -> None:
    """Lay a parcel whose earlier neighbours are laid, and write its blocks."""
    place = Place(folder)
    plan = load(place, stored).plan
    before = [_blocks(place, k) for k in plan.parcels.near(n) if k < n]
    found, _ = lay_parcel(plan, n, before)
    place.write(f"parcel-{n}", blocks_bytes(found))


def _blocks(place: Place, n: int) -> ParcelBlocks:
    return read_blocks(place.read(f"parcel-{n}"))


def label_task(folder: str, stored: str, n: int) -> None:
    """Label a laid parcel: write the charts that are inside it, and its pieces of others."""
    place = Place(folder)
    work = load(place, stored)
    plan = work.plan
    drawn = draw_parcel(plan, n, [_blocks(place, k) for k in plan.parcels.near(n)])
    pieces = {} if drawn is None else {one.chart: one for one in label_pieces(plan, drawn)}
    for chart in plan.parcels.charts[n]:
        piece = pieces.get(chart)
        if len(work.parcels_of[chart]) == 1:
            _write_chart(place, plan, chart, [] if piece is None else [piece])
        else:
            place.write(piece_name(chart, n), b"" if piece is None else piece_bytes(piece))


def join_task(folder: str, stored: str, n: int) -> None:
    """Assemble a chart's labels from the pieces of several parcels, and write it."""
    place = Place(folder)
    work = load(place, stored)
    files = [place.read(piece_name(n, parcel)) for parcel in work.parcels_of[n]]
    _write_chart(place, work.plan, n, [read_piece(data) for data in files if data])


def _write_chart(place: Place, plan: LayPlan, n: int, pieces: Sequence[LabelPiece]) -> None:
    chart = labelled(plan, n, pieces)
    place.write(f"chart-{n}", chart_bytes(chart))
    place.write(f"count-{n}", str(len(chart[0])).encode())


def paint_tiles_task(folder: str, stored: str, pages: Sequence[int]) -> None:
    """Paint and write tiles of every map, one after the other."""
    place = Place(folder)
    work = load(place, stored)
    atlas = work.atlas
    assert atlas is not None  # there are tiles
    shown = sorted(set[int]().union(*(atlas.shown_on(page) for page in pages)))
    quilt = quilt_of(work, shown, [read_chart(place.read(f"chart-{n}")) for n in shown])
    for role, image in work.maps.items():
        painter = _Painter(shown, WindowPainter(quilt, role, image))
        for page in pages:
            pixels = atlas.painted(page, role, painter)
            with work.output.writing(work.files[role][page]) as path:
                write_page(path, role, pixels, quality=work.quality)


class _Painter(NamedTuple):
    """Paints windows of charts by their numbers in the whole layout, for a quilt with only some of them."""

    shown: Sequence[int]
    painter: WindowPainter

    def __call__(self, index: int, window: tuple[slice, slice] | None = None, /) -> PixelArray:
        return self.painter.paint(self.shown.index(index), window)


def quilt_of(work: TileWork, charts: Sequence[int], own: Sequence[Labelled]) -> Quilt:
    """Return the quilt of only some of the charts, in that order."""
    placed = [part.copy() for part, _ in own]
    for number, part in enumerate(placed):
        part["chart"] = number
    return Quilt(
        tuple(work.plan.scene.charts[n] for n in charts),
        work.plan.shape,
        np.concatenate(placed),
        tuple((layer,) for _, layer in own),
        tuple(work.plan.scene.fields[n] for n in charts),
        density=work.plan.scene.density,
        has_tones=work.plan.has_tones,
    )


def piece_name(chart: int, parcel: int) -> str:
    """Return the name of the file with a parcel's piece of a chart's labels."""
    return f"piece-{chart}-{parcel}"


def _feed(found: Any, value: Any) -> None:
    """Add a value of any type to a hash."""
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
