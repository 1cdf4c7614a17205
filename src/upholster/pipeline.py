"""The whole flow on one screen: exemplar and surface, layout and synthesis, painting, files.

exemplar, surface ──► prepare ──► execute ──► quilt ──► paint ──► texels ──► mesh, atlas ──► files

With several materials each has its own exemplar, quilt and texels; the files have all of them.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from upholster._version import __version__
from upholster.charts.covered import CoveredLike, as_covered, covered_files
from upholster.coverings import (
    Covering,
    Pinned,
    asked_files,
    check_not_swapped,
    check_pinned,
    check_samples,
    check_streamed,
    counted,
    painted_model,
    read_coverings,
    read_materials,
    read_sample,
    roles_of,
    settled_values,
    synthesized,
)
from upholster.errors import InputError
from upholster.files import Outputs, outputs, path_text
from upholster.geometry import Surface
from upholster.image import Material
from upholster.image.source import Sample, Source, as_exemplar, source_names, source_parts
from upholster.joined import joined_surface
from upholster.methods import settled_seed
from upholster.model import AtlasLayout, pack_atlas
from upholster.options import ModelOptions, SampleOptions, SynthesisOptions, WriteOptions, chosen
from upholster.outputs import Output, largest_chart, parse_outputs
from upholster.parallel import TaskPool, check_running
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
        OBJ, PLY, STL, OFF), or its mesh.
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
    options, seed = chosen(WriteOptions, options), settled_seed(seed)
    asked = chosen(SynthesisOptions, synthesis)
    check_running(threads, progress)
    wanted = parse_outputs(listed(targets), options, flat=isinstance(asked.texels, tuple))
    _check_report(report)
    notes: list[str] = []
    seconds: dict[str, float] = {}
    chosen_materials, reading = read_materials(materials), chosen(ModelOptions, model)
    check_not_swapped(exemplar.source if isinstance(exemplar, Sample) else exemplar, on)
    own_sample = read_sample(exemplar, chosen(SampleOptions, sample))
    read = [*check_samples(own_sample, chosen_materials), *covered_files(on), *asked_files(asked)]
    check_pinned(pinned)
    read += [] if pinned is None else pinned.files
    check_several(wanted, chosen_materials)
    if asked.method == "paper" and options.wavelet is None:
        options = replace(options, wavelet="haar")
    with keeping(), outputs([*files_of(wanted), *([report] if report else [])], inputs=read) as files:
        with timed("read", seconds, progress):
            coverings = read_coverings(
                own_sample,
                on,
                chosen_materials,
                reading,
                asked,
                pinned=pinned,
                notes=notes,
                progress=progress,
            )
            coverings = [replace(each, largest=largest_chart(wanted, options)) for each in coverings]
            covered = coverings[0].covered
            if covered.model is not None:
                read += [os.fspath(file) for file in covered.model.inputs]
                files.keep(covered.model.inputs)
            if isinstance(covered.surface, Surface):
                _ = covered.surface.shared  # find edges that are claimed twice now, not after the work
        check_directions(wanted, covered.surface)
        check_tasks(wanted, coverings, workers, scheduler)
        roles = roles_of(coverings)
        files.add(files_of(wanted, roles, after=()))
        check_coded(wanted, source_parts(coverings[0].source), options)
        all_have = roles_of(coverings, all_have=True)
        check_displacement(options, roles=all_have, metres=metres_of(covered.surface))
        with timed("prepare", seconds, progress):
            if has_stream(wanted):
                check_streamed(coverings[0])
            layout = _layout(wanted, coverings, options)
            files.add(files_of(wanted, roles, layout, after=roles))
        in_memory = not are_tiles_alone(wanted, coverings)
        notes += [note for each in coverings for note in each.notes(in_memory=in_memory)]
        if tell is not None:
            for note in notes:
                tell(note)
        making = _Making(wanted, coverings, options, layout, seed, threads, progress, tell, seconds)
        textured, written, counts = making.made(files, workers, scheduler)
        notes += [] if textured is None else notes_after(wanted, textured, seconds, tell)
        parameters = {
            "exemplar": None if own_sample is None else source_names(own_sample),
            "materials": {pattern: source_names(each) for pattern, each in chosen_materials.items()},
            **{"on": _surface_name(on), "threads": threads, "workers": workers, "scheduler": scheduler},
            **_all_options(
                SampleOptions() if own_sample is None else own_sample.options, reading, asked, options
            ),
            "seed": seed,
        }
        if callable(parameters["direction"]):
            parameters["direction"] = coverings[0].prepared.direction
        result = CoverReport(
            __version__,
            parameters,
            settled_values(coverings) | quality_words(wanted, textured),
            counts,
            totalled(seconds),
            peak_memory(),
            written,
            notes,
            list(dict.fromkeys(read)),
            textured,
        )
        if report:
            files.path(report).write_text(json.dumps(result.to_json(), indent=2) + "\n", encoding="utf-8")
    return result


def _layout(
    wanted: Sequence[Output], coverings: Sequence[Covering], options: WriteOptions
) -> AtlasLayout | None:
    """Return the places of all coverings' charts in one atlas; None if no output has an atlas."""
    if not any(output.kind.atlas for output in wanted):
        return None
    surface = joined_surface([each.surface for each in coverings])
    charts = [chart for each in coverings for chart in each.charts]
    return pack_atlas(surface, charts, **options.packing)


_Made = tuple[TexturedModel | None, dict[str, int], dict[str, int]]
"""The model, the bytes of each file, and counts for the report."""


@dataclass(frozen=True, eq=False, slots=True)
class _Making:
    """Prepared work, and how to do it."""

    wanted: Sequence[Output]
    coverings: Sequence[Covering]
    options: WriteOptions
    layout: AtlasLayout | None
    seed: int
    threads: int | None
    progress: Progress | None
    tell: Callable[[str], None] | None
    seconds: dict[str, float]

    def made(self, files: Outputs, workers: int | None, scheduler: str | None) -> _Made:
        """Lay blocks, paint and write, by tasks if requested."""
        in_memory = workers is None and scheduler is None
        if in_memory and not are_tiles_alone(self.wanted, self.coverings):
            return self.in_memory(files)
        with task_pool(workers, scheduler, self.threads) as pool:
            return self.by_tasks(files, pool)

    def by_tasks(self, files: Outputs, pool: TaskPool) -> _Made:
        """Lay blocks by tasks; if only tiles are written, paint them by tasks too, and make no model."""
        run: dict[str, Any] = {"seed": self.seed, "progress": self.progress, "tell": self.tell}
        first, output = self.coverings[0], self.wanted[0]
        with timed("synthesize", self.seconds):
            if are_tiles_alone(self.wanted, self.coverings):
                return (None, *tiled(first, self.wanted, self.options, pool, files, **run))
            quilts = [spread_quilt(first, output, pool, **run)]
        textured, written, counts = self._written(files, quilts)
        return textured, written, counts | pool.counts()

    def in_memory(self, files: Outputs) -> _Made:
        """Lay blocks on threads of this process."""
        with timed("synthesize", self.seconds):
            quilts = synthesized(self.coverings, seed=self.seed, threads=self.threads, progress=self.progress)
        return self._written(files, quilts)

    def _written(self, files: Outputs, quilts: Sequence[Quilt]) -> _Made:
        running: dict[str, Any] = {"threads": self.threads, "progress": self.progress}
        with timed("paint", self.seconds):
            textured = painted_model(self.coverings, quilts, self.options, **running)
        textured = replace(textured, packed=self.layout)
        written = written_to(self.wanted, textured, files, self.seconds, self.progress)
        return textured, written, counted(self.coverings, quilts, textured) | page_counts(textured)


def _check_report(report: str | os.PathLike[str] | None) -> None:
    if report is not None and not path_text(report, "report").lower().endswith(".json"):
        raise InputError(f"report {os.fspath(report)!r} has suffix {Path(report).suffix!r}; allowed: .json")


def _all_options(*kinds: Any) -> dict[str, Any]:
    return {name: value for kind in kinds for name, value in asdict(kind).items()}


def _surface_name(on: CoveredLike) -> str:
    return os.fspath(on) if isinstance(on, (str, os.PathLike)) else repr(on)


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
