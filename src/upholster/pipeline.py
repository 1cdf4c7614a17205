"""The whole flow on one screen.

Request ──► Scene ──► Quilt ──► TexturedModel ──► files

`upholster.synthesis.execution` makes the quilt; between scene and quilt method "quilt" has a `LayPlan`.
With several materials, the request is read as one for each: each has its own scene, quilt and texels, and the
files have all of them.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from upholster.base.files import outputs
from upholster.base.options.choices import chosen, seed_number
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import Progress
from upholster.charts.surface_to_cover import CoveredLike
from upholster.covering.cover_report import check_report, cover_report, written_report
from upholster.covering.joint_work import (
    atlas_layout,
    check_read,
    check_streamed,
    counted,
    declare_files,
    for_files,
    laid_quilts,
    painted_model,
    read_notes,
    roles_of,
    work_notes,
)
from upholster.covering.pins import Pinned
from upholster.covering.request import Request
from upholster.covering.sample_arguments import check_not_swapped, read_materials, read_sample
from upholster.covering.tasks.task_covering import (
    are_tiles_alone,
    check_tasks,
    spread_quilt,
    task_pool,
    tiled,
)
from upholster.image.files.source import Sample, Source
from upholster.output.output_writer import check_several, files_of, notes_after, write, written_to
from upholster.output.refinement import RefineReport, refine
from upholster.output.reports import CoverReport, timed
from upholster.runtime.parallel import given_threads, report_note, running
from upholster.runtime.stages import keeping

__all__ = ["CoverReport", "RefineReport", "carry_out", "cover", "refine", "write"]


def cover(
    exemplar: Source | Sample | None,
    on: CoveredLike,
    targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    *,
    materials: Mapping[str, Source | Sample] | None = None,
    sample: SampleOptions | Mapping[str, Any] | None = None,
    model: ModelOptions | Mapping[str, Any] | None = None,
    synthesis: SynthesisOptions | Mapping[str, Any] | None = None,
    seed: int | None = 0,
    options: WriteOptions | None = None,
    pinned: Pinned | None = None,
    report: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
) -> CoverReport:
    """Cover a surface with an exemplar and write the results, as the command ``upholster cover`` does.

    Parameters
    ----------
    exemplar
        Image file, see `upholster.read_exemplar`. Or a material: a folder or zip file with its maps, several
        files named by role, files by role (see `upholster.read_material`), or the material itself; or a
        `Sample`, which includes its options and width. Its maps are matched together (by methods "paper" and
        "pixel": only the base colour), and one quilt paints them all. None only if there are `materials`.
    on
        The surface: a text, see `upholster.surface_from_spec`, a file's path, or a `Surface`. With method
        "paper" a sphere consists of octants, unless its text says otherwise. Or a model's file (GLB, glTF,
        OBJ, PLY, STL, OFF, 3MF), its mesh, or ``sample:chair``, a model in the program.
    targets
        Files to write, one or several, by suffix; none may be an input. ``atlas:`` before an image's path
        writes the atlas instead of a picture. With texels of width × height, images are the flat texture
        itself. A material's other maps are written next to atlas, flat texture and OBJ, named by role:
        ``wall_normal.png`` for ``wall.png``; pictures of the model show all of them but the height. An atlas
        above 8192² has several pages: in a GLB each is a material, images are ``wall_1.png``, ``wall_2.png``
        … An image with ``<UDIM>`` in its name is an atlas in UDIM tiles; texture coordinates of an OBJ then
        fit them. If only tiles on patches are written, they are written one by one, and may be larger than
        memory: see docs/scaling.md.
    materials
        Several on one model's file: samples by the names of parts, ``{"Seat": "leather/", "Leg*":
        "oak.jpg@30cm"}``. Patterns are as for `upholster.ModelOptions`; the first one that fits a part
        counts. A length after an @ is the sample's width. `exemplar` covers all parts that no pattern fits;
        without it those stay unchanged. Streams can not be written with several materials.
    sample
        How `exemplar` is read: `upholster.SampleOptions`, or some of them by name.
    model
        How a model's file is read: `upholster.ModelOptions`, or some of them by name.
    synthesis
        How it is covered: `upholster.SynthesisOptions`, or some of them by name.
    seed
        As for `upholster.synthesize`. None draws a random seed, which the report lists.
    options
        How models and pictures are written.
    pinned
        Regions that stay as they were, see `upholster.Project.pin`.
    report
        The file for the report as JSON: its name ends in ``.json``.
    threads, progress
        As for `upholster.synthesize`; stage "read", within it "faces" and "mesh" while a CAD model is read;
        "prepare", "unwrap" while a model is laid out, "blocks", "seams" or "texels", then "paint" and
        "render".
    workers, scheduler
        Lay the surface and paint tiles on this many processes of this machine, or on the workers of a Dask
        scheduler, ``tcp://host:8786``: with method "quilt". The result is the same.
    tell
        Called with each note of the report before the work begins.

    Returns
    -------
    CoverReport
        Parameters, counts and times.

    Raises
    ------
    InputError, FormatError
        Raised before any work if possible; then nothing is written.
    """
    check_not_swapped(exemplar.source if isinstance(exemplar, Sample) else exemplar, on)
    request = Request(
        read_sample(exemplar, chosen(SampleOptions, sample)),
        on,
        read_materials(materials),
        chosen(ModelOptions, model),
        chosen(SynthesisOptions, synthesis),
        chosen(WriteOptions, options),
        seed_number(seed),
        pinned,
    )
    with running(threads, progress, tell):
        return carry_out(for_files(request, targets), report, workers=workers, scheduler=scheduler)


def carry_out(
    request: Request,
    report: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> CoverReport:
    """Read, lay out, lay blocks, paint and write; parameters and errors are as for `cover`."""
    check_report(report)
    wanted, seconds, inputs = request.outputs, dict[str, float](), request.files()
    check_several(wanted, request.materials)
    with keeping(), outputs([*files_of(wanted), *([report] if report else [])], inputs=inputs) as files:
        with timed("read", seconds, reported=True):
            requests = request.read()
        notes = _said(read_notes(requests))
        declare_files(requests, files)
        check_read(requests)
        check_tasks(requests, workers, scheduler)
        with timed("prepare", seconds, reported=True):
            scenes = [each.scene for each in requests]
            check_streamed(requests, scenes)
            layout = atlas_layout(requests, scenes)
            files.add(files_of(wanted, roles_of(requests), layout))
        alone, model = are_tiles_alone(requests), None
        notes += _said(work_notes(requests, in_memory=not alone))
        with task_pool(workers, scheduler) as pool:
            with timed("synthesize", seconds):
                if alone:
                    written, counts = tiled(requests[0], pool, files)
                elif workers is None and scheduler is None:
                    quilts = laid_quilts(requests)
                else:
                    quilts = [spread_quilt(requests[0], pool)]
            if not alone:
                with timed("paint", seconds):
                    model = replace(painted_model(requests, quilts), packed=layout)
                written = written_to(wanted, model, files, seconds)
                counts = counted(requests, model)
                notes += _said(notes_after(wanted, model, seconds))
            counts |= pool.counts()
        how = {"threads": given_threads(), "workers": workers, "scheduler": scheduler}
        found = cover_report(
            request, requests, running=how, seconds=seconds,
            written=written, counts=counts, notes=notes, model=model,
        )  # fmt: skip
        if report:
            written_report(found, files.path(report))
    return found


def _said(notes: list[str]) -> list[str]:
    for note in notes:
        report_note(note)
    return notes
