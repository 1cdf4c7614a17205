"""A covering made by tasks: its tiles are written one by one, or its quilt is made on many workers."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from upholster.cluster import cluster_pool
from upholster.coverings.covering import Covering
from upholster.errors import InputError, check_whole
from upholster.export import PagedMesh, write_tiled_obj
from upholster.files import Outputs
from upholster.formats import UDIM
from upholster.geometry import Surface
from upholster.image import alpha_channel
from upholster.image.source import source_parts
from upholster.methods import lay_plan
from upholster.model import tessellate
from upholster.options import WriteOptions
from upholster.outputs import Output
from upholster.parallel import TaskPool, thread_pool
from upholster.quilt import Quilt
from upholster.reports import laid_counts
from upholster.tiles.storage import Place
from upholster.tiles.task_order import laid_by_tasks, write_tiles
from upholster.tiles.work import TileWork, tile_work
from upholster.types import Progress

__all__ = ["are_tiles_alone", "check_tasks", "spread_quilt", "task_pool", "tiled"]

_FOLDER = ".upholster"
"""Suffix of the outputs' name for the folder in which an unfinished run keeps its data."""


def are_tiles_alone(wanted: Sequence[Output], coverings: Sequence[Covering]) -> bool:
    """Return whether tasks write one set of tiles of patches, and any other output is OBJ.

    The OBJ then refers to the tiles, and needs no texels.
    """
    others = [output for output in wanted if not output.in_tiles]
    are_obj = all(output.tiles is not None for output in others)
    patches = isinstance(coverings[0].surface, Surface)
    return len(wanted) == len(others) + 1 and are_obj and patches and _is_by_tasks(coverings)


def check_tasks(
    wanted: Sequence[Output], coverings: Sequence[Covering], workers: int | None, scheduler: str | None
) -> None:
    """Raise InputError if workers or a URL are requested for work that tasks cannot do."""
    if workers is not None and scheduler is not None:
        raise InputError("workers and scheduler are both given; allowed: one of them")
    if workers is not None:
        check_whole("workers", workers, 1, 256)
    if scheduler is not None and not isinstance(scheduler, str):
        raise InputError(
            f"scheduler is a {type(scheduler).__name__}; allowed: an address as text, 'tcp://host:8786'"
        )
    if not (workers is None and scheduler is None) and not _is_by_tasks(coverings):
        raise InputError(
            "workers are given, but there is no work for several by methods 'paper' and 'pixel', with "
            "several materials, with again, put or pins, or of a flat texture; allowed there: --threads"
        )
    if any(output.url for output in wanted) and not are_tiles_alone(wanted, coverings):
        raise InputError(
            "tiles are to be written to a URL, but not alone, or not of a surface of patches by method "
            "'quilt'; allowed there: a folder on this machine"
        )


def _is_by_tasks(coverings: Sequence[Covering]) -> bool:
    first = coverings[0]
    if first.held is not None or first.asked.again or first.asked.put:
        return False
    is_flat = first.asked.tileable or isinstance(first.asked.texels, tuple)
    return len(coverings) == 1 and first.pattern is None and first.asked.method == "quilt" and not is_flat


def task_pool(
    workers: int | None, scheduler: str | None, threads: int | None
) -> AbstractContextManager[TaskPool]:
    """Return a pool: on threads of this process, unless workers or a scheduler are given."""
    if workers is None and scheduler is None:
        return thread_pool(threads)
    return cluster_pool(workers, scheduler)


def tiled(
    covering: Covering,
    wanted: Sequence[Output],
    options: WriteOptions,
    pool: TaskPool,
    files: Outputs,
    *,
    seed: int,
    progress: Progress | None,
    tell: Callable[[str], None] | None,
) -> tuple[dict[str, int], dict[str, int]]:
    """Write the tiles of a covering, one by one; return the bytes of each file, and the report's counts.

    Finished work is kept in any case, and the next run with the same inputs continues from it. Other outputs,
    OBJ, are written when all tiles exist.
    """
    output = next(output for output in wanted if output.in_tiles)
    surface, place = covering.surface, _place_of(output)
    assert isinstance(surface, Surface)  # checked by `are_tiles_alone`
    plan = lay_plan(covering.prepared, covering.seen, seed=seed)
    maps = source_parts(covering.source)
    density = covering.prepared.density
    work = tile_work(plan, density, (surface, output.path.name), maps, place, options)
    written, placed = write_tiles(work, _folder_of(output), pool, progress=progress, tell=tell)
    for other in wanted:
        if other is not output:
            written |= _written_obj(surface, other, work, options, files)
    counts = laid_counts(surface, covering.charts, (placed, 0), maps["albedo"])
    return written, counts | {"maps": len(maps)} | pool.counts()


def _written_obj(
    surface: Surface, output: Output, work: TileWork, options: WriteOptions, files: Outputs
) -> dict[str, int]:
    """Write an OBJ that refers to the tiles; return the bytes of its files."""
    assert work.atlas is not None  # there are tiles
    seams = [seam for own in work.atlas.seams.values() for seam in own]
    mesh = tessellate(surface, work.atlas.charts, seams, quads=options.quads)
    page, uv = work.atlas.layout.page_coordinates(mesh)
    names = output.tile_names(role for role in work.maps if role != "albedo")
    places = [files.path(target) for target in output.own]
    alpha = alpha_channel(work.maps["albedo"].shape[2]) is not None
    paged = PagedMesh(mesh, uv, (), page)
    write_tiled_obj(places[0], places[1], paged, names, stem=output.path.stem, alpha=alpha)
    return {str(target): place.stat().st_size for target, place in zip(output.own, places, strict=True)}


def spread_quilt(
    covering: Covering,
    output: Output,
    pool: TaskPool,
    *,
    seed: int,
    progress: Progress | None,
    tell: Callable[[str], None] | None,
) -> Quilt:
    """Return the quilt of a covering, laid by tasks; their files are next to the output in the meantime."""
    plan, density = lay_plan(covering.prepared, covering.seen, seed=seed), covering.prepared.density
    work = tile_work(plan, density, None, {}, _place_of(output), WriteOptions())
    quilt = laid_by_tasks(work, _folder_of(output), pool, progress=progress, tell=tell)
    return quilt.on(covering.surface, seed=seed, density=density)


def _place_of(output: Output) -> Place:
    return Place(output.url or str(output.path.parent.absolute()))


def _folder_of(output: Output) -> Place:
    stem = Path(output.path.name.replace(UDIM, "")).stem.rstrip("._-")
    return _place_of(output).inside(f"{stem or 'tiles'}{_FOLDER}")
