"""A project: model, samples and all settings. It answers quickly after small changes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from upholster.apps.project.preview import Preview, Previews
from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError, nearest
from upholster.base.options.choices import chosen, seed_number
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import Progress, frozen_array
from upholster.charts.maps.map_text import parse_map
from upholster.charts.surface_to_cover import CoveredLike, covered_files
from upholster.covering.joint_work import for_files, laid_quilts
from upholster.covering.pins import Pinned, check_pinned
from upholster.covering.request import Request
from upholster.covering.sample_arguments import check_not_swapped, check_samples, read_materials
from upholster.image.files.source import Sample
from upholster.output.reports import CoverReport
from upholster.pipeline import carry_out
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import report_note, running

__all__ = ["KINDS", "Project"]

KINDS: dict[str, Any] = {"reading": ModelOptions, "synthesis": SynthesisOptions, "writing": WriteOptions}
"""The fields of a project that hold options, and the kind of each."""


@dataclass(frozen=True, eq=False)
class Project(Shown):
    """A model, its samples and all settings; it does not change, `change` returns another.

    Projects made by `change` share their results: a file is read once, a model is laid out flat once, and
    each further step runs again only if one of its inputs has changed. To undo changes, keep a list of
    projects.

    Attributes
    ----------
    model
        The surface to cover: as for `upholster.cover`.
    sample
        Covers the model, or the parts without a material; None: those parts stay unchanged.
    materials
        Other samples by the names of parts, as for `upholster.cover`.
    reading
        How the model is read.
    synthesis
        How it is covered.
    writing
        How files are written.
    seed
        0 to 2^63 − 1.
    pinned
        Regions that stay as they were; None: no region does.
    notes
        Warnings about its file: that another file has changed since.
    previews
        The results that it shares with projects made from it, and the running preview.

    Raises
    ------
    InputError
        If there is no sample, or a value is out of range.
    """

    model: CoveredLike
    sample: Sample | None = None
    materials: Mapping[str, Sample] = field(default_factory=dict)
    reading: ModelOptions = field(default_factory=ModelOptions)
    synthesis: SynthesisOptions = field(default_factory=SynthesisOptions)
    writing: WriteOptions = field(default_factory=WriteOptions)
    seed: int = 0
    pinned: Pinned | None = None
    notes: tuple[str, ...] = ()
    previews: Previews = field(default_factory=Previews, repr=False)

    def __post_init__(self) -> None:
        settled: dict[str, Any] = {name: chosen(kind, getattr(self, name)) for name, kind in KINDS.items()}
        settled["sample"] = None if self.sample is None else _frozen(Sample.of(self.sample))
        settled["materials"] = read_materials(self.materials)
        settled["seed"] = seed_number(self.seed)
        for name, value in settled.items():
            object.__setattr__(self, name, value)
        check_samples(self.sample, self.materials)
        check_pinned(self.pinned, self.synthesis.method)
        check_not_swapped(None if self.sample is None else self.sample.source, self.model)

    def __repr__(self) -> str:
        samples = self.sample.source if self.sample and not self.materials else list(self.materials)
        return on_a_line(self, {"model": self.model, "samples": samples, "seed": self.seed})

    def change(self, **choices: Any) -> "Project":
        """Return a copy with some settings changed.

        Parameters
        ----------
        choices
            `model`, `sample`, `materials`, `seed`, or any option by its name in `upholster.ModelOptions`,
            `upholster.SampleOptions` (of `sample`), `upholster.SynthesisOptions` and
            `upholster.WriteOptions`: ``sample_size="20cm"``. None restores an option's default.

        Raises
        ------
        InputError
            For an unknown name, or a value that is out of range.
        """
        names = {"model", "sample", "materials", "seed"} & choices.keys()
        found: dict[str, Any] = {name: choices.pop(name) for name in names}
        sample = found.get("sample", self.sample)
        found["sample"] = None if sample is None else Sample.of(sample)
        if found["sample"] is not None and {"sample_size", "element_size"} & choices.keys():
            found["sample"] = replace(found["sample"], size=None)  # the latest choice counts
        for name, kind in KINDS.items():
            found[name] = _changed(getattr(self, name), kind, choices)
        of_sample = {entry.name for entry in fields(SampleOptions)} & choices.keys()
        if of_sample:
            if found["sample"] is None:
                raise InputError(f"{min(of_sample)} is set, but there is no sample; allowed: with one")
            options = _changed(found["sample"].options, SampleOptions, choices)
            found["sample"] = replace(found["sample"], options=options)
        changes = bool(names - {"seed"} or of_sample or found["reading"] != self.reading)
        if self.pinned is not None and changes:
            raise InputError("a pinned region can not stay if model or sample change; allowed: unpin first")
        if choices:
            known = [entry.name for kind in (SampleOptions, *KINDS.values()) for entry in fields(kind)]
            raise InputError(f"unknown option {next(iter(choices))!r}; {nearest(next(iter(choices)), known)}")
        return replace(self, **found)

    def again(self, region: str, seed: int | None = None) -> "Project":
        """Return another project in which a region is laid again; everything else stays as it is.

        Parameters
        ----------
        region
            Where a map is white, see `upholster.charts.maps.map_text.parse_map`: ``"0,0,1:0.3"`` (a ball),
            ``"part:Seat"``, ``"mask.png"``.
        seed
            0 to 2^63 − 1; None: one that no region has used.

        Raises
        ------
        InputError
            If the region is not a map.
        """
        before = self.synthesis.again or ()
        number = len(before) + 1 if seed is None else seed_number(seed)
        parse_map(region)
        return self.change(again=(*before, f"{region}@{number}"))

    def pin(self, region: str) -> "Project":
        """Return another project in which a region stays as it is now, even if seed and guides change.

        Model, sample, sizes and directions can not change while something is pinned.

        Raises
        ------
        InputError
            If the region is not a map, or regions are pinned at more than eight states.
        """
        before = self.pinned
        regions = (region,) if before is None else (*before.regions, region)
        if before is not None and (before.synthesis, before.seed) == (self.synthesis, self.seed):
            before = before.before
        return replace(self, pinned=Pinned(regions, self.synthesis, self.seed, before))

    def unpin(self) -> "Project":
        """Return another project in which nothing is pinned."""
        return replace(self, pinned=None)

    def request(self, targets: Sequence[str] | str | None = None) -> Request:
        """Return the project as a request, for writing files if `targets` are named."""
        how = self.reading, self.synthesis, self.writing, self.seed, self.pinned
        request = Request(self.sample, self.model, self.materials, *how)
        return for_files(request, targets)

    @property
    def samples(self) -> list[Sample]:
        """All samples, first those of named parts, then the one of all other parts."""
        return [*self.materials.values(), *([self.sample] if self.sample else [])]

    def files(self) -> list[str]:
        """Return the files and folders that the project names."""
        folders = (name for each in self.samples for name in each.folders)
        return list(dict.fromkeys([*folders, *self.request().files()]))

    def inputs(self) -> list[str]:
        """Return the files that the model is read from: a glTF file names others."""
        with self.previews.stages.active():
            covered = self.request().read()[0].covered
        named = covered_files(self.model)
        more = () if covered.model is None else map(str, covered.model.inputs)
        return list(dict.fromkeys([*named, *more]))

    def quilts(self, *, threads: int | None = None, progress: Progress | None = None) -> list[Quilt]:
        """Return the quilt of each sample, as `cover` writes them."""
        with running(threads, progress), self.previews.stages.active():
            return laid_quilts(self.request().read())

    def preview(
        self, *, texels: int = 1_000_000, threads: int | None = None, progress: Progress | None = None
    ) -> Preview:
        """Begin to cover the model, and return an iterator over looks at it.

        A running preview of this project, or of one that it was made from, is cancelled.

        Parameters
        ----------
        texels
            Largest number of texels to paint, margins of charts included.
        threads, progress
            As in `upholster.synthesize`; `progress` is called in a thread of the preview, and `done` of
            `total` grows over all stages and looks.

        Returns
        -------
        Preview
            Yields looks at the complete model: soon a coarse one, then better ones; the last has the quilts
            that `cover` writes.
        """
        with running(threads, progress):
            return self.previews.begin(self.request().read, texels)

    def cover(
        self,
        targets: Sequence[str] | str,
        *,
        report: str | None = None,
        threads: int | None = None,
        workers: int | None = None,
        scheduler: str | None = None,
        progress: Progress | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> CoverReport:
        """Write files with this project's settings; the other arguments are those of `upholster.cover`."""
        with running(threads, progress, tell), self.previews.stages.active():
            for note in self.notes:
                report_note(note)
            found = carry_out(self.request(targets), report, workers=workers, scheduler=scheduler)
        return replace(found, notes=[*self.notes, *found.notes])


def _frozen(sample: Sample) -> Sample:
    """Return a sample whose pixels can not change, because results computed from them are kept."""
    pixels = sample.source
    if not isinstance(pixels, np.ndarray) or not pixels.flags.writeable:
        return sample
    return replace(sample, source=frozen_array(pixels.copy()))


def _changed(options: Any, kind: type[Any], choices: dict[str, Any]) -> Any:
    """Return options with the choices of their kind applied; those are removed from `choices`."""
    defaults = kind()
    own = {name: choices.pop(name) for name in [entry.name for entry in fields(kind)] if name in choices}
    back = {name: getattr(defaults, name) for name, value in own.items() if value is None}
    return replace(chosen(kind, options, **own), **back)
