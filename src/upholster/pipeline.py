"""The whole flow on one screen: exemplar and surface, layout and synthesis, painting, files.

exemplar, surface ──► prepare ──► execute ──► quilt ──► paint ──► texels ──► mesh, atlas ──► files

With several materials each has its own exemplar, quilt and texels; the files have all of them.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from upholster._version import __version__
from upholster.charts.surface_to_cover import CoveredLike, as_covered
from upholster.coverings.covering import Covering, check_streamed
from upholster.coverings.joint_work import (
    counted,
    painted_model,
    read_notes,
    roles_of,
    settled_values,
    synthesized,
    work_notes,
)
from upholster.coverings.pins import Pinned
from upholster.coverings.request import Request, check_not_swapped, read_materials, read_sample
from upholster.coverings.request_reading import read_coverings
from upholster.errors import InputError
from upholster.files import Outputs, outputs, path_text, write_bytes
from upholster.geometry import Surface
from upholster.image import Material
from upholster.image.source import Sample, Source, as_exemplar, source_names, source_parts
from upholster.joined import joined_surface
from upholster.methods import settled_seed
from upholster.model import AtlasLayout, pack_atlas
from upholster.options import ModelOptions, SampleOptions, SynthesisOptions, WriteOptions, chosen
from upholster.outputs import Output, largest_chart, parse_outputs
from upholster.parallel import check_running
from upholster.quilt import Quilt, Texels
from upholster.refining import RefineReport, refine
from upholster.reports import CoverReport, page_counts, peak_memory, timed, totalled
from upholster.stages import keeping
from upholster.textured import TexturedModel, check_displacement, metres_of, textured_model
from upholster.tiles import are_tiles_alone, check_tasks, spread_quilt, task_pool, tiled
from upholster.types import PixelArray, Progress
from upholster.writing import (
    check_coded,
    check_directions,
    check_several,
    files_of,
    has_stream,
    listed,
    notes_after,
    quality_words,
    written_to,
)

__all__ = ["CoverReport", "RefineReport", "cover", "refine", "write"]


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
    # Everything that can be checked without reading a file is checked first.
    options, seed = chosen(WriteOptions, options), settled_seed(seed)
    asked = chosen(SynthesisOptions, synthesis)
    check_running(threads, progress, tell)
    wanted = parse_outputs(listed(targets), options, flat=isinstance(asked.texels, tuple))
    _check_report(report)
    by_part, reading = read_materials(materials), chosen(ModelOptions, model)
    check_not_swapped(exemplar.source if isinstance(exemplar, Sample) else exemplar, on)
    own = read_sample(exemplar, chosen(SampleOptions, sample))
    request = Request(own, on, by_part, reading, asked, pinned)
    inputs = request.checked_files()
    check_several(wanted, by_part)
    if asked.method == "paper" and options.wavelet is None:
        options = replace(options, wavelet="haar")
    with keeping(), outputs([*files_of(wanted), *([report] if report else [])], inputs=inputs) as files:
        run = _Run(wanted, options, files, seed, threads, workers, scheduler, progress, tell)
        coverings = _read(request, run)
        notes = run.reported(read_notes(coverings))
        _check_read(coverings, run)
        layout = _prepare(coverings, run)
        notes += run.reported(work_notes(coverings, in_memory=not are_tiles_alone(wanted, coverings)))
        textured, written, counts = _make(coverings, layout, run)
        notes += [] if textured is None else run.reported(notes_after(wanted, textured, run.seconds))
        model_file = coverings[0].covered.model
        read = [*inputs, *map(os.fspath, () if model_file is None else model_file.inputs)]
        result = CoverReport(
            __version__,
            _parameters(request, run, coverings),
            settled_values(coverings) | quality_words(wanted, textured),
            counts,
            totalled(run.seconds),
            peak_memory(),
            written,
            notes,
            list(dict.fromkeys(read)),
            textured,
        )
        if report:
            write_bytes(files.path(report), (json.dumps(result.to_json(), indent=2) + "\n").encode())
    return result


@dataclass(frozen=True, eq=False, slots=True)
class _Run:
    """What is to be written, how the work runs, and the time of each stage so far."""

    wanted: Sequence[Output]
    options: WriteOptions
    files: Outputs
    seed: int
    threads: int | None
    workers: int | None
    scheduler: str | None
    progress: Progress | None
    tell: Callable[[str], None] | None
    seconds: dict[str, float] = field(default_factory=dict)

    def reported(self, notes: list[str]) -> list[str]:
        """Report notes to the caller at once; return them."""
        if self.tell is not None:
            for note in notes:
                self.tell(note)
        return notes


def _read(request: Request, run: _Run) -> list[Covering]:
    """Read the model and the samples."""
    with timed("read", run.seconds, run.progress):
        largest = largest_chart(run.wanted, run.options)
        coverings = read_coverings(request, largest=largest, progress=run.progress)
        covered = coverings[0].covered
        if covered.model is not None:
            run.files.keep(covered.model.inputs)
        if isinstance(covered.surface, Surface):
            _ = covered.surface.shared  # find edges that are claimed twice now, not after the work
    return coverings


def _check_read(coverings: Sequence[Covering], run: _Run) -> None:
    """Check what is asked against the model and samples that were read."""
    surface = coverings[0].surface
    check_directions(run.wanted, surface)
    check_tasks(run.wanted, coverings, run.workers, run.scheduler)
    run.files.add(files_of(run.wanted, roles_of(coverings), after=()))
    check_coded(run.wanted, source_parts(coverings[0].source), run.options)
    check_displacement(run.options, roles=roles_of(coverings, all_have=True), metres=metres_of(surface))


def _prepare(coverings: Sequence[Covering], run: _Run) -> AtlasLayout | None:
    """Return the places of all coverings' charts in one atlas; None if no output has an atlas."""
    roles, layout = roles_of(coverings), None
    with timed("prepare", run.seconds, run.progress):
        if has_stream(run.wanted):
            check_streamed(coverings[0])
        if any(output.kind.atlas for output in run.wanted):
            surface = joined_surface([each.surface for each in coverings])
            charts = [chart for each in coverings for chart in each.charts]
            layout = pack_atlas(surface, charts, **run.options.packing)
        run.files.add(files_of(run.wanted, roles, layout, after=roles))
    return layout


_Made = tuple[TexturedModel | None, dict[str, int], dict[str, int]]
"""The model, the bytes of each file, and counts for the report. No model if tiles were written one by one."""


def _make(coverings: Sequence[Covering], layout: AtlasLayout | None, run: _Run) -> _Made:
    """Lay blocks, paint and write, by tasks if requested."""
    alone = are_tiles_alone(run.wanted, coverings)
    if run.workers is None and run.scheduler is None and not alone:
        with timed("synthesize", run.seconds):
            quilts = synthesized(coverings, seed=run.seed, threads=run.threads, progress=run.progress)
        return _write_model(coverings, quilts, layout, run)
    how: dict[str, Any] = {"seed": run.seed, "progress": run.progress, "tell": run.tell}
    with task_pool(run.workers, run.scheduler, run.threads) as pool:
        with timed("synthesize", run.seconds):
            if alone:
                return (None, *tiled(coverings[0], run.wanted, run.options, pool, run.files, **how))
            quilts = [spread_quilt(coverings[0], run.wanted[0], pool, **how)]
        textured, written, counts = _write_model(coverings, quilts, layout, run)
        return textured, written, counts | pool.counts()


def _write_model(
    coverings: Sequence[Covering], quilts: Sequence[Quilt], layout: AtlasLayout | None, run: _Run
) -> _Made:
    """Paint the quilts and write all outputs."""
    with timed("paint", run.seconds):
        textured = painted_model(coverings, quilts, run.options, threads=run.threads, progress=run.progress)
    textured = replace(textured, packed=layout)
    written = written_to(run.wanted, textured, run.files, run.seconds, run.progress)
    return textured, written, counted(coverings, quilts, textured) | page_counts(textured)


def _parameters(request: Request, run: _Run, coverings: Sequence[Covering]) -> dict[str, Any]:
    """Return all parameters for the report, including defaults."""
    sample, on, asked = request.sample, request.on, request.synthesis
    read_with = SampleOptions() if sample is None else sample.options
    options = [asdict(kind) for kind in (read_with, request.reading, asked, run.options)]
    found = {
        "exemplar": None if sample is None else source_names(sample),
        "materials": {pattern: source_names(each) for pattern, each in request.materials.items()},
        "on": os.fspath(on) if isinstance(on, (str, os.PathLike)) else repr(on),
        **{"threads": run.threads, "workers": run.workers, "scheduler": run.scheduler},
        **{name: value for each in options for name, value in each.items()},
        "seed": run.seed,
    }
    return found | ({"direction": coverings[0].prepared.direction} if callable(asked.direction) else {})


def _check_report(report: str | os.PathLike[str] | None) -> None:
    if report is not None and not path_text(report, "report").lower().endswith(".json"):
        raise InputError(f"report {os.fspath(report)!r} has suffix {Path(report).suffix!r}; allowed: .json")


def write(
    target: str | os.PathLike[str],
    surface: CoveredLike,
    texels: Texels | Mapping[str, Texels],
    *,
    quilt: Quilt | None = None,
    exemplar: PixelArray | Material | Source | None = None,
    flat: bool = False,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a textured surface to one file, a model, stream or picture by its suffix.

    Parameters
    ----------
    target
        The file; ``atlas:`` before an image's path writes the atlas instead of a picture.
    surface
        The surface; or its text form, or the path of its file.
    texels
        Its texels, from `upholster.paint`; or a material's by role, from `upholster.paint_material`.
    quilt, exemplar
        The quilt and the exemplar, or material, that the texels were painted from: streams hold them instead.
        By default those that the texels refer to.
    flat
        Whether an image is the texels of the only chart, not a picture of the model.
    options
        Mesh, texture format and picture, see `upholster.WriteOptions`.
    threads, progress
        As for `upholster.synthesize`; stage "render" for pictures.

    Raises
    ------
    InputError
        For an unknown suffix, a place that cannot be written, texels of another surface, or without the role
        "albedo".
    """
    options = chosen(WriteOptions, options)
    wanted = parse_outputs([target], options, flat=flat)
    check_running(threads, progress)
    found = None if exemplar is None else as_exemplar(exemplar)
    model = textured_model(
        texels,
        surface=as_covered(surface, patches=_are_on_patches(texels)).surface,
        quilt=quilt,
        exemplar=found,
        options=options,
        threads=threads,
    )
    layout = model.layout if any(output.kind.atlas for output in wanted) else None
    with outputs(files_of(wanted, tuple(model.maps), layout)) as files:
        written_to(wanted, model, files, {}, progress)


def _are_on_patches(texels: Texels | Mapping[str, Texels]) -> bool:
    base = texels.get("albedo") if isinstance(texels, Mapping) else texels
    return isinstance(base, Texels) and isinstance(base.surface, Surface)
