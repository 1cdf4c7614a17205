"""A request by tasks: its tiles are written one by one, or its quilt is made on many workers."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from upholster.base.errors import InputError, check_whole
from upholster.base.files import Outputs
from upholster.base.formats import UDIM
from upholster.base.options.write_options import WriteOptions
from upholster.charts.tessellation.mesh import tessellate
from upholster.covering.request import Request
from upholster.covering.tasks.job_runs import cluster_pool
from upholster.covering.tasks.storage import Place
from upholster.covering.tasks.task_order import laid_by_tasks, write_tiles
from upholster.covering.tasks.work import TileWork, tile_work
from upholster.geometry.patches.surface import Surface
from upholster.image.color import alpha_channel
from upholster.image.files.source import source_parts
from upholster.output.export.obj import write_tiled_obj
from upholster.output.export.pages import PagedMesh
from upholster.output.outputs import Output
from upholster.output.reports import laid_counts
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import TaskPool, thread_pool
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.method import lay_plan
from upholster.synthesis.quilt.scene import Scene

__all__ = ["are_tiles_alone", "check_tasks", "spread_quilt", "task_pool", "tiled"]

_FOLDER = ".upholster"
"""Suffix of the outputs' name for the folder in which an unfinished run keeps its data."""


def are_tiles_alone(requests: Sequence[Request]) -> bool:
    """Return whether tasks write one set of tiles of patches, and any other output is OBJ.

    The OBJ then refers to the tiles, and needs no texels.
    """
    wanted = requests[0].outputs
    others = [output for output in wanted if not output.in_tiles]
    are_obj = all(output.tiles is not None for output in others)
    patches = isinstance(requests[0].surface, Surface)
    return len(wanted) == len(others) + 1 and are_obj and patches and _is_by_tasks(requests)


def check_tasks(requests: Sequence[Request], workers: int | None, scheduler: str | None) -> None:
    """Raise InputError if workers or a URL are requested for work that tasks cannot do."""
    if workers is not None and scheduler is not None:
        raise InputError("workers and scheduler are both given; allowed: one of them")
    if workers is not None:
        check_whole("workers", workers, 1, 256)
    if scheduler is not None and not isinstance(scheduler, str):
        raise InputError(
            f"scheduler is a {type(scheduler).__name__}; allowed: an address as text, 'tcp://host:8786'"
        )
    if not (workers is None and scheduler is None) and not _is_by_tasks(requests):
        raise InputError(
            "workers are given, but there is no work for several by methods 'paper' and 'pixel', with "
            "several materials, with again, put or pins, or of a flat texture; allowed there: --threads"
        )
    if any(output.url for output in requests[0].outputs) and not are_tiles_alone(requests):
        raise InputError(
            "tiles are to be written to a URL, but not alone, or not of a surface of patches by method "
            "'quilt'; allowed there: a folder on this machine"
        )


def _is_by_tasks(requests: Sequence[Request]) -> bool:
    first, asked = requests[0], requests[0].synthesis
    if first.pinned is not None or asked.again or asked.put:
        return False
    is_flat = asked.tileable or isinstance(asked.texels, tuple)
    return len(requests) == 1 and first.pattern is None and asked.method == "quilt" and not is_flat


def task_pool(workers: int | None, scheduler: str | None) -> AbstractContextManager[TaskPool]:
    """Return a pool: on threads of this process, unless workers or a scheduler are given."""
    if workers is None and scheduler is None:
        return thread_pool()
    return cluster_pool(workers, scheduler)


def tiled(request: Request, pool: TaskPool, files: Outputs) -> tuple[dict[str, int], dict[str, int]]:
    """Write the tiles of a request, one by one; return the bytes of each file, and the report's counts.

    Finished work is kept in any case, and the next run with the same inputs continues from it. Other outputs,
    OBJ, are written when all tiles exist.
    """
    wanted, options = request.outputs, request.writing
    output = next(output for output in wanted if output.in_tiles)
    surface, place, maps = request.surface, _place_of(output), source_parts(request.source)
    assert isinstance(surface, Surface)  # checked by `are_tiles_alone`
    work = tile_work(_plan(request), (surface, output.path.name), maps, place, options)
    written, placed = write_tiles(work, _folder_of(output), pool)
    for other in wanted:
        if other is not output:
            written |= _written_obj(surface, other, work, options, files)
    counts = laid_counts(surface, request.charts, (placed, 0), maps["albedo"])
    return written, counts | {"maps": len(maps)}


def _plan(request: Request) -> LayPlan:
    assert isinstance(request.scene, Scene)  # checked by `_is_by_tasks`
    return lay_plan(request.scene, request.exemplar, seed=request.seed)


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


def spread_quilt(request: Request, pool: TaskPool) -> Quilt:
    """Return the quilt of a request, laid by tasks; their files are next to its output in the meantime."""
    output = request.outputs[0]
    work = tile_work(_plan(request), None, {}, _place_of(output), WriteOptions())
    quilt = laid_by_tasks(work, _folder_of(output), pool)
    return quilt.on(request.surface, seed=request.seed, density=work.plan.scene.density)


def _place_of(output: Output) -> Place:
    return Place(output.url or str(output.path.parent.absolute()))


def _folder_of(output: Output) -> Place:
    stem = Path(output.path.name.replace(UDIM, "")).stem.rstrip("._-")
    return _place_of(output).inside(f"{stem or 'tiles'}{_FOLDER}")
