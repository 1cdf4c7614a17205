"""Samples and the surface of each: one sample on a whole surface, or several, each on parts of a model."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import cast

import numpy as np

from upholster.charts.axis_directions import closed_rounds
from upholster.charts.covered import Covered, CoveredLike, as_covered, covered_files, covered_parts
from upholster.charts.directions import stroke_texts
from upholster.charts.layout import LONGEST, texture_scale
from upholster.charts.maps import parse_map
from upholster.charts.part_directions import is_by_part, part_direction, triangles_by_direction
from upholster.elements import find_lattice
from upholster.errors import FormatError, InputError
from upholster.fitting import fitted
from upholster.formats import is_model_name
from upholster.geometry import AnySurface, MeshSurface, Surface
from upholster.geometry.mesh_files import ModelFile
from upholster.image import IMAGE_SUFFIXES, Material
from upholster.image.roles import ROLES
from upholster.image.source import Sample, Source, read_source, source_parts, used_pixels
from upholster.joined import joined_model
from upholster.methods import (
    Guidance,
    Prepared,
    asked_files,
    coarser,
    execute,
    given_guidance,
    holding,
    kept_sample,
    matched_image,
    needs_patches,
    prepare,
    read_guidance,
    sample_width,
    sized_sample,
)
from upholster.methods.quilt.guides import cropped
from upholster.options import ModelOptions, SampleOptions, SynthesisOptions, WriteOptions
from upholster.quilt import Chart, Quilt
from upholster.quilt.painting import PAINTED_DENSITIES
from upholster.reports import counts_of, notes_before, settled_words
from upholster.shown import on_a_line
from upholster.stream import check_layout
from upholster.stream.plan import refuse_pixel
from upholster.textured import TexturedModel
from upholster.types import PixelArray, Progress
from upholster.writing import painted

__all__ = [
    "MOST_PINNED",
    "Covering",
    "Pinned",
    "Request",
    "asked_files",
    "check_not_swapped",
    "check_pinned",
    "check_samples",
    "check_streamed",
    "counted",
    "notes_of",
    "painted_model",
    "progress_of_each",
    "read_coverings",
    "read_materials",
    "read_sample",
    "roles_of",
    "settled_values",
    "synthesized",
]

MOST_PINNED = 8
"""Largest number of states at which regions are pinned: each state is laid again."""

_REST = "the others"
"""Name in reports for the parts that no pattern fits."""


def check_not_swapped(exemplar: Source | None, on: CoveredLike) -> None:
    """Raise InputError if the sample is a model and the surface an image."""
    named = exemplar if isinstance(exemplar, (list, tuple)) else [exemplar]
    texts = [os.fspath(one) for one in (*named, on) if isinstance(one, (str, os.PathLike))]
    models = [text for text in texts[:-1] if is_model_name(text)]
    if len(texts) == len(named) + 1 and models and Path(texts[-1]).suffix.lower() in IMAGE_SUFFIXES:
        raise InputError(
            f"sample {models[0]!r} is a model, and the surface {texts[-1]!r} is an image; "
            f"allowed: the other way round, {texts[-1]} --on {models[0]}"
        )


def check_samples(sample: Sample | None, materials: Mapping[str, Sample]) -> list[str]:
    """Return the files that all samples are read from.

    Raises
    ------
    InputError
        If there is no sample at all.
    """
    if sample is None and not materials:
        raise InputError("no SAMPLE is given; allowed: one, or --material for parts of a model")
    return [file for each in (*([sample] if sample else []), *materials.values()) for file in each.files]


def check_pinned(pinned: object) -> None:
    """Raise InputError unless `pinned` is None or comes from `upholster.Project.pin`."""
    if not (pinned is None or isinstance(pinned, Pinned)):
        raise InputError(f"pinned is {on_a_line(pinned)}; allowed: a result of `Project.pin`")


def read_sample(source: Source | Sample | None, options: SampleOptions) -> Sample | None:
    """Return a sample with the options that are given separately.

    Raises
    ------
    InputError
        If options are given without a sample, or with one that has options of its own.
    """
    if options == SampleOptions():
        return None if source is None else Sample.of(source)
    names = ", ".join(name for name, value in asdict(options).items() if value)
    if source is None:
        raise InputError(
            f"{names} is for SAMPLE, and none is given; allowed: with one, or `upholster prepare` for "
            "other samples"
        )
    found = Sample.of(source)
    if found.options != SampleOptions():
        raise InputError(f"{names} is given for a sample that has options of its own; allowed: one of both")
    return replace(found, options=options)


def read_materials(materials: Mapping[str, Source | Sample] | None) -> dict[str, Sample]:
    """Read samples by their parts, optionally with widths after an @: ``{"Seat": "oak.jpg@30cm"}``.

    Raises
    ------
    InputError
        If it is not a mapping, a pattern is empty or given twice in other letters, or a size is not a length.
    """
    if materials is None:
        return {}
    if not isinstance(materials, Mapping) or not all(isinstance(name, str) for name in materials):
        raise InputError(f"materials are {on_a_line(materials)}; allowed: samples by the name of a part")
    known: set[str] = set()
    for pattern in materials:
        if not pattern or pattern.lower() in known:
            raise InputError(
                f"material for {pattern!r} is given twice, or for no name; allowed: each name once"
            )
        known.add(pattern.lower())
    return {pattern: _material(pattern, source) for pattern, source in materials.items()}


def _material(pattern: str, source: Source | Sample) -> Sample:
    if not isinstance(source, (str, os.PathLike)):
        return Sample.of(source)
    text = os.fspath(source)
    return sized_sample(text, f"material for {pattern!r}")


@dataclass(frozen=True, slots=True)
class Pinned:
    """Regions that stay as they were when pinned.

    Attributes
    ----------
    regions
        Each as `upholster.charts.maps.parse_map` reads it.
    synthesis, seed
        The options and the seed with which they were laid.
    before
        The regions that were pinned at that time; None for none.
    """

    regions: tuple[str, ...]
    synthesis: SynthesisOptions
    seed: int
    before: "Pinned | None" = None

    def __post_init__(self) -> None:
        for text in self.regions:
            parse_map(text)
        if self.depth > MOST_PINNED:
            raise InputError(
                f"regions are pinned at {self.depth} states; allowed: {MOST_PINNED}; unpin, then pin again"
            )

    @property
    def depth(self) -> int:
        """The number of states at which regions were pinned."""
        return 1 if self.before is None else 1 + self.before.depth

    @property
    def files(self) -> list[str]:
        """The files that the regions and options name."""
        own = [file for text in self.regions for file in parse_map(text).files]
        return [*own, *asked_files(self.synthesis), *([] if self.before is None else self.before.files)]


@dataclass(frozen=True, eq=False)
class Covering:
    """A sample and the surface that it covers.

    Attributes
    ----------
    pattern
        The pattern of the parts that it covers; None: all parts.
    covered
        The surface.
    source
        The sample or material for matching and painting.
    asked
        The options for laying it.
    title
        The material's name in a file.
    largest
        Greatest height and width of a chart on patches, in texels.
    guidance
        Guides, zones, regions and pieces; None for none.
    held
        The earlier covering whose regions stay, and its seed; None if no region stays.
    notes
        Warnings from reading, one line each.
    """

    pattern: str | None
    covered: Covered
    source: PixelArray | Material
    asked: SynthesisOptions
    title: str = ""
    largest: int = LONGEST
    guidance: Guidance | None = None
    held: "tuple[Covering, int] | None" = None
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its name in reports; empty if it covers all parts."""
        return "" if self.pattern is None else self.pattern or _REST

    @property
    def surface(self) -> AnySurface:
        """The surface."""
        return self.covered.surface

    @property
    def roles(self) -> tuple[str, ...]:
        """The maps of the sample other than the base colour."""
        return tuple(source_parts(self.source))[1:]

    @cached_property
    def seen(self) -> PixelArray:
        """The pixels that are matched."""
        return matched_image(self.source, self.asked)

    @property
    def first(self) -> PixelArray:
        """The pixels that are matched, without the samples of zones."""
        zones = None if self.guidance is None else self.guidance.zones
        return self.seen if zones is None else cropped(self.seen, zones.rectangles[0])

    @cached_property
    def prepared(self) -> Prepared:
        """The settled parameters of the synthesis; InputError if one is out of range."""
        with _naming(self.name):
            return prepare(
                self.seen,
                self.surface,
                self.asked,
                largest=self.largest,
                model=self.covered.model,
                used=used_pixels(self.source),
                guidance=self.guidance,
            )

    @property
    def charts(self) -> tuple[Chart, ...]:
        """The layout for painting, in texels."""
        return self.prepared.painted

    @property
    def texels(self) -> int:
        """The number of texels."""
        return sum(chart.height * chart.width for chart in self.charts)

    def work_notes(self, *, in_memory: bool) -> list[str]:
        """Return warnings about the work ahead; `in_memory` says whether all texels will be in memory."""
        maps = 1 + len(self.roles) if in_memory else 0
        found = notes_before(self.surface, self.prepared, self.first, maps)
        return [f"{self.name}: {note}" if self.name else note for note in found]

    def synthesized(
        self, *, octaves: int = 0, seed: int, threads: int | None, progress: Progress | None
    ) -> Quilt:
        """Return the quilt; for a quick look one with steps longer by `octaves` powers of two."""
        with _naming(self.name):
            prepared = coarser(self.prepared, self.seen, octaves) if octaves else self.prepared
            if self.held is not None:
                before, own_seed = self.held
                if not np.array_equal(before.seen, self.seen):
                    raise InputError("a pinned region can not stay if the sample changes; allowed: unpin it")
                quilt = before.synthesized(octaves=octaves, seed=own_seed, threads=threads, progress=None)
                prepared = holding(prepared, quilt)
            return execute(prepared, self.seen, self.surface, seed=seed, threads=threads, progress=progress)

    def textured(
        self,
        quilt: Quilt,
        options: WriteOptions,
        *,
        density: float | None = None,
        threads: int | None,
        progress: Progress | None,
    ) -> TexturedModel:
        """Return the model with its texels, painted at `density` texels per step each way."""
        density = quilt.density if density is None else density
        texels, others = painted(quilt, self.source, threads, progress, density=density)
        return TexturedModel(
            self.surface, texels, options, threads, quilt, self.source, others,
            file=self.covered.model, field=self.prepared.field, name=self.title, density=density,
        )  # fmt: skip


@dataclass(frozen=True, eq=False, slots=True)
class Request:
    """What is to be covered, with which samples, and how.

    Attributes
    ----------
    sample
        For all parts without a material; None leaves those parts unchanged.
    on
        The surface; with materials, a model's file.
    materials
        Other samples, each for parts of the model.
    reading, synthesis
        How the model is read, and how it is covered. A number of texels is the total of all materials.
    pinned
        Regions that stay as they were; None for none.
    """

    sample: Sample | None
    on: CoveredLike
    materials: Mapping[str, Sample]
    reading: ModelOptions
    synthesis: SynthesisOptions
    pinned: Pinned | None = None

    def checked_files(self) -> list[str]:
        """Return the files that it names.

        Raises
        ------
        InputError
            If there is no sample at all, a text that names a file is malformed, or `pinned` has another type.
        """
        found = check_samples(self.sample, self.materials)
        found += [*covered_files(self.on), *asked_files(self.synthesis)]
        check_pinned(self.pinned)
        return found if self.pinned is None else found + self.pinned.files


def read_coverings(
    request: Request, *, largest: int = LONGEST, progress: Progress | None = None
) -> list[Covering]:
    """Read the surface and the samples that cover it.

    Parameters
    ----------
    request
        What to read. Its samples are checked, see `check_samples`.
    largest
        As for `Covering`.
    progress
        As for `as_covered`.

    Raises
    ------
    InputError, FormatError
        As for `covered_parts` and `read_source`, with the material's pattern.
    """
    on, reading, asked, rest = request.on, request.reading, request.synthesis, request.sample
    if not request.materials:
        assert rest is not None  # `check_samples` made sure
        paper, patches = asked.method == "paper", needs_patches(asked)
        covered = as_covered(on, reading, biquadratic=paper, patches=patches, progress=progress)
        return [_with_pins(_covering(None, covered, rest, asked, largest), rest, request.pinned)]
    given = given_guidance(asked) or ([] if request.pinned is None else ["a pinned region"])
    if given:
        raise InputError(f"{given[0]} is given with several materials; allowed: with one sample")
    if asked.method != "quilt":
        raise InputError(f"method is {asked.method!r} with several materials; allowed there: 'quilt'")
    parts = covered_parts(on, list(request.materials), reading, rest=rest is not None, progress=progress)
    out: list[Covering] = []
    for pattern, covered in parts.items():
        own = request.materials.get(pattern, rest)
        assert own is not None  # other parts are covered only with a sample
        with _naming(pattern or _REST):
            out.append(_covering(pattern, covered, own, _share(asked, covered, parts), largest))
    return out


def _covering(
    pattern: str | None, covered: Covered, sample: Sample, asked: SynthesisOptions, largest: int
) -> Covering:
    read_notes: list[str] = []
    source = read_source(sample, notes=read_notes)
    if isinstance(source, Material):
        prefix = "" if pattern is None else f"{pattern or _REST}: "
        read_notes += [prefix + note for note in source.notes]
    if sample.size is not None:
        asked = replace(asked, sample_size=sample.size, element_size=None)
    if asked.stroke is not None:
        asked = replace(asked, stroke=stroke_texts(asked.stroke))
    asked, fit_notes = _with_axes(asked, covered, source)
    metres = covered.surface.mesh.metres if isinstance(covered.surface, MeshSurface) else None
    source, guidance = read_guidance(asked, source, sample.options, metres)
    source, title = kept_sample(source, asked), "" if pattern is None else _title(sample.source, pattern)
    notes = (*covered.notes, *read_notes, *fit_notes)
    return Covering(pattern, covered, source, asked, title, largest, guidance, notes=notes)


def _with_pins(covering: Covering, sample: Sample, pinned: Pinned | None) -> Covering:
    # Returns a covering with regions that stay as they were.
    if pinned is None:
        return covering
    before = _covering(None, covering.covered, sample, pinned.synthesis, covering.largest)
    held = (_with_pins(before, sample, pinned.before), pinned.seed)
    regions = replace(covering.guidance or Guidance(), held=tuple(map(parse_map, pinned.regions)))
    return replace(covering, guidance=regions, held=held)


def _with_axes(
    asked: SynthesisOptions, covered: Covered, source: PixelArray | Material
) -> tuple[SynthesisOptions, list[str]]:
    """Return options with the direction on each part of a model, and the size that fits; and notes."""
    if not is_by_part(asked.direction):
        return asked, []
    if covered.model is None:
        file = "a CAD model's file" if isinstance(asked.direction, str) else "a model's file"
        raise InputError(f"direction is {on_a_line(asked.direction)}; allowed: with {file}")
    direction = part_direction(covered.model, cast(str | Mapping[str, str], asked.direction))
    notes = []
    if asked.fit:
        asked, note = _fitted(asked, covered, covered.model, matched_image(source, asked))
        notes = [note]
    return replace(asked, direction=direction, fit=False), notes


def _fitted(
    asked: SynthesisOptions, covered: Covered, model: ModelFile, seen: PixelArray
) -> tuple[SynthesisOptions, str]:
    """Return options with a sample size for which whole periods go round; and a note about the result."""
    lattice = find_lattice(seen)
    by_direction = triangles_by_direction(model, cast(str | Mapping[str, str], asked.direction))
    around, along = (
        closed_rounds(model, by_direction[kind]) if kind in by_direction else []
        for kind in ("around", "along")
    )
    count = len(around) + len(along)
    if lattice is None or not count:
        why = "the sample does not repeat surely enough" if lattice is None else "no cylinder closes round"
        return asked, f"nothing is fitted: {why}"
    width = sample_width(seen, asked, model.mesh.metres)
    scale = texture_scale(covered.surface, seen.shape[1], sample_size=width)
    factor, left = fitted(lattice, around, along, scale.scale)
    wide = factor * scale.sample_size
    note = (
        f"the sample is {wide:.4g} wide instead of {scale.sample_size:.4g} ({100 * (factor - 1):+.1f} %), so "
        f"that whole periods go round {count} cylinder{'s' * (count > 1)}; {left:.2f} of one "
        "is left over"
    )
    return replace(asked, sample_size=wide, element_size=None), note


def _share(asked: SynthesisOptions, covered: Covered, parts: Mapping[str, Covered]) -> SynthesisOptions:
    """Return options with the share of the texels that falls to one surface of several, by their areas."""
    if not isinstance(asked.texels, int):
        return asked
    share = _area(covered) / sum(_area(each) for each in parts.values())
    return replace(asked, texels=max(64, round(asked.texels * share)))


def _area(covered: Covered) -> float:
    assert isinstance(covered.surface, MeshSurface)  # a model's
    return float(covered.surface.mesh.areas[covered.surface.island >= 0].sum())


def _title(source: Source | None, pattern: str) -> str:
    """Return a material's name in a file: the name of the sample's file or folder."""
    if isinstance(source, Sequence) and not isinstance(source, str) and len(source) == 1:
        source = source[0]
    return Path(source).stem if isinstance(source, (str, os.PathLike)) else pattern


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Name the material in errors of a block."""
    try:
        yield
    except (FormatError, InputError) as error:
        called = name if name == _REST else repr(name)
        raise type(error)(f"material for {called}: {error}" if name else str(error)) from None


def check_streamed(covering: Covering) -> None:
    """Raise InputError if a stream can not hold a surface with this layout, or this method."""
    surface, prepared, (height, width) = covering.surface, covering.prepared, covering.seen.shape[:2]
    if not isinstance(surface, Surface):
        return
    if covering.asked.method == "pixel":
        refuse_pixel(covering.texels, (height, width))
    check_layout(surface, prepared.charts, (height, width))


def notes_of(coverings: Sequence[Covering], *, in_memory: bool = True) -> list[str]:
    """Return all warnings from reading, then all about the work ahead; see `Covering.work_notes`."""
    found = [note for each in coverings for note in each.notes]
    return found + [note for each in coverings for note in each.work_notes(in_memory=in_memory)]


def roles_of(coverings: Sequence[Covering], *, all_have: bool = False) -> tuple[str, ...]:
    """Return the maps, other than the base colour, that at least one covering has, or that all have."""
    has = all if all_have else any
    return tuple(role for role in ROLES if has(role in each.roles for each in coverings))


def progress_of_each(progress: Progress | None, sizes: Sequence[int]) -> list[Progress | None]:
    """Return, for each of several tasks of given sizes, a function that reports their joint progress."""
    if progress is None or len(sizes) == 1:
        return [progress] * len(sizes)
    before = [sum(sizes[:number]) for number in range(len(sizes))]

    def report(start: int, size: int, stage: str, done: int, total: int) -> None:
        assert progress is not None
        progress(stage, start + size * done // max(1, total), sum(sizes))

    return [partial(report, start, size) for start, size in zip(before, sizes, strict=True)]


def synthesized(
    coverings: Sequence[Covering], *, seed: int, threads: int | None, progress: Progress | None
) -> list[Quilt]:
    """Return the quilt of each covering."""
    shares = progress_of_each(progress, [each.texels for each in coverings])
    return [
        each.synthesized(seed=seed, threads=threads, progress=share)
        for each, share in zip(coverings, shares, strict=True)
    ]


def painted_model(
    coverings: Sequence[Covering],
    quilts: Sequence[Quilt],
    options: WriteOptions,
    *,
    texels: int | None = None,
    threads: int | None,
    progress: Progress | None,
) -> TexturedModel:
    """Return the model with the texels of all coverings; at most `texels` of them, if given."""
    shares = progress_of_each(progress, [each.texels for each in coverings])
    return joined_model(
        [
            each.textured(
                quilt,
                options,
                density=_density(coverings, each, quilt, texels),
                threads=threads,
                progress=share,
            )
            for each, quilt, share in zip(coverings, quilts, shares, strict=True)
        ]
    )


def _density(
    coverings: Sequence[Covering], covering: Covering, quilt: Quilt, texels: int | None
) -> float | None:
    """Return the texels per step with which a quilt has its share of `texels`; None: as exported."""
    all_texels = sum(each.texels for each in coverings)
    if texels is None or texels >= all_texels:
        return None
    steps = sum(chart.height * chart.width for chart in quilt.charts)
    density = math.sqrt(texels * covering.texels / all_texels / steps)
    return min(max(density, PAINTED_DENSITIES[0]), PAINTED_DENSITIES[1])


def settled_values(coverings: Sequence[Covering]) -> dict[str, str]:
    """Return automatic choices in words; for several materials, one line for each."""
    found = {
        each.name: settled_words(each.prepared, each.surface, each.asked, each.roles) for each in coverings
    }
    if len(coverings) == 1 and not coverings[0].name:
        return found[""]
    return {
        name: "; ".join(f"{key} {value}" for key, value in words.items()) for name, words in found.items()
    }


def counted(coverings: Sequence[Covering], quilts: Sequence[Quilt], model: TexturedModel) -> dict[str, int]:
    """Return counts of charts, texels and the like, over all coverings."""
    counts = [counts_of(model.surface, quilt, model.texels) for quilt in quilts]
    summed = {name: sum(each[name] for each in counts) for name in _SUMMED}
    materials = {"materials": len(coverings)} if len(coverings) > 1 else {}
    return counts[0] | summed | {"maps": 1 + len(model.maps)} | materials


_SUMMED = ("charts", "texels", "painted texels", "placements", "edge blocks")
