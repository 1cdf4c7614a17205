"""Samples and what each covers: one on all of a surface, or several, each on parts of a model."""

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
from upholster.charts.covered import Covered, CoveredLike, as_covered, covered_parts
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
    holding,
    is_guided,
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
    "asked_files",
    "check_not_swapped",
    "check_pinned",
    "check_samples",
    "check_streamed",
    "counted",
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
"""States at which something is pinned: each is laid once more."""

_REST = "the others"
"""What a report calls the parts that no pattern fits."""


def check_not_swapped(exemplar: Source | None, on: CoveredLike) -> None:
    """Raise InputError where the sample is a model, and what is covered an image."""
    named = exemplar if isinstance(exemplar, (list, tuple)) else [exemplar]
    texts = [os.fspath(one) for one in (*named, on) if isinstance(one, (str, os.PathLike))]
    models = [text for text in texts[:-1] if is_model_name(text)]
    if len(texts) == len(named) + 1 and models and Path(texts[-1]).suffix.lower() in IMAGE_SUFFIXES:
        raise InputError(
            f"sample {models[0]!r} is a model, and what it is to cover, {texts[-1]!r}, an image; "
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
    """Raise InputError for what is neither None nor of `upholster.Project.pin`."""
    if not (pinned is None or isinstance(pinned, Pinned)):
        raise InputError(f"pinned is {on_a_line(pinned)}; allowed: what `Project.pin` makes")


def read_sample(source: Source | Sample | None, options: SampleOptions) -> Sample | None:
    """Return a sample, read as options say that are told beside it.

    Raises
    ------
    InputError
        If there are options and no sample, or one with options of its own.
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
        raise InputError(f"{names} is told of a sample that has options of its own; allowed: one of both")
    return replace(found, options=options)


def read_materials(materials: Mapping[str, Source | Sample] | None) -> dict[str, Sample]:
    """Read samples by the parts that they are for, sizes behind an @ as well: ``{"Seat": "oak.jpg@30cm"}``.

    Raises
    ------
    InputError
        If it is no mapping, a pattern is empty or there twice in other letters, or a size is no length.
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
    """Regions that stay as they were when they were pinned.

    Attributes
    ----------
    regions
        Each as `upholster.charts.maps.parse_map` reads it.
    synthesis, seed
        With which they were laid.
    before
        What was pinned when that was; None: nothing.
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
                f"regions are pinned at {self.depth} states; allowed: {MOST_PINNED}, so unpin, and pin anew"
            )

    @property
    def depth(self) -> int:
        """At how many states something was pinned."""
        return 1 if self.before is None else 1 + self.before.depth

    @property
    def files(self) -> list[str]:
        """The files that it names."""
        own = [file for text in self.regions for file in parse_map(text).files]
        return [*own, *asked_files(self.synthesis), *([] if self.before is None else self.before.files)]


@dataclass(frozen=True, eq=False)
class Covering:
    """A sample, and what it covers.

    Attributes
    ----------
    pattern
        Of the parts that it covers; None: all that there are.
    covered
        The surface.
    source
        The sample or material, as it is matched and painted.
    asked
        How it is laid.
    title
        Of the material in a file.
    largest
        Texels: greatest height and width of a chart on patches.
    guidance
        What is asked of where things go; None: nothing.
    held
        What covered it before, of which regions stay, and its seed; None: nothing stays.
    """

    pattern: str | None
    covered: Covered
    source: PixelArray | Material
    asked: SynthesisOptions
    title: str = ""
    largest: int = LONGEST
    guidance: Guidance | None = None
    held: "tuple[Covering, int] | None" = None

    @property
    def name(self) -> str:
        """What reports call it; empty for one that covers all."""
        return "" if self.pattern is None else self.pattern or _REST

    @property
    def surface(self) -> AnySurface:
        """What it covers."""
        return self.covered.surface

    @property
    def roles(self) -> tuple[str, ...]:
        """The maps of the sample beside the base colour."""
        return tuple(source_parts(self.source))[1:]

    @cached_property
    def seen(self) -> PixelArray:
        """What is matched."""
        return matched_image(self.source, self.asked)

    @property
    def first(self) -> PixelArray:
        """What is matched, without the samples of zones."""
        zones = None if self.guidance is None else self.guidance.zones
        return self.seen if zones is None else cropped(self.seen, zones.rectangles[0])

    @cached_property
    def prepared(self) -> Prepared:
        """What will be done, settled; InputError if something is out of range."""
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
        """The layout as it is painted, in texels."""
        return self.prepared.painted

    @property
    def texels(self) -> int:
        """How many it has."""
        return sum(chart.height * chart.width for chart in self.charts)

    def notes(self, *, in_memory: bool = True) -> list[str]:
        """Return what the user should know before the work begins, which may hold all texels in memory."""
        maps = 1 + len(self.roles) if in_memory else 0
        found = notes_before(self.surface, self.prepared, self.first, maps)
        return [f"{self.name}: {note}" if self.name else note for note in found]

    def synthesized(
        self, *, octaves: int = 0, seed: int, threads: int | None, progress: Progress | None
    ) -> Quilt:
        """Return the quilt; for a quick look one whose steps are longer by so many powers of two."""
        with _naming(self.name):
            prepared = coarser(self.prepared, self.seen, octaves) if octaves else self.prepared
            if self.held is not None:
                before, own_seed = replace(self.held[0], largest=self.largest), self.held[1]
                if not np.array_equal(before.seen, self.seen):
                    raise InputError(
                        "a pinned region can not stay where the sample changes; allowed: unpin it"
                    )
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
        """Return the model with its texels painted, so many for a step each way."""
        density = quilt.density if density is None else density
        texels, others = painted(quilt, self.source, threads, progress, density=density)
        return TexturedModel(
            self.surface, texels, options, threads, quilt, self.source, others,
            file=self.covered.model, field=self.prepared.field, name=self.title, density=density,
        )  # fmt: skip


def read_coverings(
    sample: Sample | None,
    on: CoveredLike,
    materials: Mapping[str, Sample],
    reading: ModelOptions,
    asked: SynthesisOptions,
    *,
    pinned: Pinned | None = None,
    notes: list[str],
    progress: Progress | None = None,
) -> list[Covering]:
    """Read what is covered, and with which samples.

    Parameters
    ----------
    sample
        For all that no material is for; None: that is left as it is.
    on
        The surface; with materials, a model's file.
    materials
        Other samples, each for parts of the model.
    reading, asked
        How the model is read, and how it is covered. A number of texels is for all together.
    pinned
        Regions that stay as they were; None: nothing does.
    notes
        What the user should know is added.
    progress
        As of `as_covered`.

    Raises
    ------
    InputError, FormatError
        As `covered_parts` and `read_source`, with the material's pattern.
    """
    if not materials:
        assert sample is not None  # `check_samples` looked
        covered = as_covered(
            on,
            reading,
            biquadratic=asked.method == "paper",
            patches=needs_patches(asked),
            progress=progress,
        )
        notes += covered.notes
        return [_pinned(_covering(None, covered, sample, asked, notes), sample, pinned)]
    if is_guided(asked) or pinned is not None:
        raise InputError("guides and zones are given with several materials; allowed: with one sample")
    if asked.method != "quilt":
        raise InputError(f"method is {asked.method!r} with several materials; allowed there: 'quilt'")
    parts = covered_parts(on, list(materials), reading, rest=sample is not None, progress=progress)
    out: list[Covering] = []
    for pattern, covered in parts.items():
        notes += covered.notes
        own = materials.get(pattern, sample)
        assert own is not None  # there is a rest only with a sample
        title = _title(own.source, pattern)
        shared = _share(asked, covered, parts)
        with _naming(pattern or _REST):
            out.append(_covering(pattern, covered, own, shared, notes, title))
    return out


def _covering(
    pattern: str | None,
    covered: Covered,
    sample: Sample,
    asked: SynthesisOptions,
    notes: list[str],
    title: str = "",
) -> Covering:
    source = read_source(sample, notes=notes)
    if isinstance(source, Material):
        notes += source.notes if pattern is None else [f"{pattern or _REST}: {note}" for note in source.notes]
    if sample.size is not None:
        asked = replace(asked, sample_size=sample.size, element_size=None)
    if asked.stroke is not None:
        asked = replace(asked, stroke=stroke_texts(asked.stroke))
    asked = _with_axes(asked, covered, source, notes)
    mesh = covered.surface.mesh if isinstance(covered.surface, MeshSurface) else None
    metres = None if mesh is None else mesh.metres
    source, guidance = read_guidance(asked, source, sample.options, metres)
    return Covering(pattern, covered, kept_sample(source, asked), asked, title, guidance=guidance)


def _pinned(covering: Covering, sample: Sample, pinned: Pinned | None) -> Covering:
    # A covering with regions that stay as they were.
    if pinned is None:
        return covering
    held = tuple(map(parse_map, pinned.regions))
    before = _covering(None, covering.covered, sample, pinned.synthesis, [])
    return replace(
        covering,
        guidance=replace(covering.guidance or Guidance(), held=held),
        held=(_pinned(before, sample, pinned.before), pinned.seed),
    )


def _with_axes(
    asked: SynthesisOptions, covered: Covered, source: PixelArray | Material, notes: list[str]
) -> SynthesisOptions:
    """Return options with the direction on each part of a model, and the size that fits round its axes."""
    if not is_by_part(asked.direction):
        return asked
    if covered.model is None:
        file = "a CAD model's file" if isinstance(asked.direction, str) else "a model's file"
        raise InputError(f"direction is {on_a_line(asked.direction)}; allowed: with {file}")
    direction = part_direction(covered.model, cast(str | Mapping[str, str], asked.direction))
    if asked.fit:
        asked = _fitted(asked, covered, covered.model, matched_image(source, asked), notes)
    return replace(asked, direction=direction, fit=False)


def _fitted(
    asked: SynthesisOptions, covered: Covered, model: ModelFile, seen: PixelArray, notes: list[str]
) -> SynthesisOptions:
    """Return options with a size by which whole periods go round; a note tells what comes of it."""
    lattice = find_lattice(seen)
    by_direction = triangles_by_direction(model, cast(str | Mapping[str, str], asked.direction))
    around, along = (
        closed_rounds(model, by_direction[kind]) if kind in by_direction else []
        for kind in ("around", "along")
    )
    count = len(around) + len(along)
    if lattice is None or not count:
        why = "the sample does not repeat surely enough" if lattice is None else "no cylinder closes round"
        notes.append(f"nothing is fitted: {why}")
        return asked
    width = sample_width(seen, asked, model.mesh.metres)
    scale = texture_scale(covered.surface, seen.shape[1], sample_size=width)
    factor, left = fitted(lattice, around, along, scale.scale)
    wide = factor * scale.sample_size
    notes.append(
        f"the sample is {wide:.4g} wide instead of {scale.sample_size:.4g} ({100 * (factor - 1):+.1f} %), so "
        f"that whole periods go round {count} cylinder{'s' * (count > 1)}; {left:.2f} of one "
        "is left over"
    )
    return replace(asked, sample_size=wide, element_size=None)


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
    """Return what a material is called in a file: as the sample's file or folder."""
    if isinstance(source, Sequence) and not isinstance(source, str) and len(source) == 1:
        source = source[0]
    return Path(source).stem if isinstance(source, (str, os.PathLike)) else pattern


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Say of which material it is that something is wrong."""
    try:
        yield
    except (FormatError, InputError) as error:
        called = name if name == _REST else repr(name)
        raise type(error)(f"material for {called}: {error}" if name else str(error)) from None


def check_streamed(covering: Covering) -> None:
    """Raise InputError where a stream can not hold a surface with this layout, or that method."""
    surface, prepared, (height, width) = covering.surface, covering.prepared, covering.seen.shape[:2]
    if not isinstance(surface, Surface):
        return
    if covering.asked.method == "pixel":
        refuse_pixel(covering.texels, (height, width))
    check_layout(surface, prepared.charts, (height, width))


def roles_of(coverings: Sequence[Covering], *, all_have: bool = False) -> tuple[str, ...]:
    """Return the maps beside the base colour that one of them has, or that all have."""
    has = all if all_have else any
    return tuple(role for role in ROLES if has(role in each.roles for each in coverings))


def progress_of_each(progress: Progress | None, sizes: Sequence[int]) -> list[Progress | None]:
    """Return for each of several works of some sizes a function that tells how far all together are."""
    if progress is None or len(sizes) == 1:
        return [progress] * len(sizes)
    before = [sum(sizes[:number]) for number in range(len(sizes))]

    def tell(start: int, size: int, stage: str, done: int, total: int) -> None:
        assert progress is not None
        progress(stage, start + size * done // max(1, total), sum(sizes))

    return [partial(tell, start, size) for start, size in zip(before, sizes, strict=True)]


def synthesized(
    coverings: Sequence[Covering], *, seed: int, threads: int | None, progress: Progress | None
) -> list[Quilt]:
    """Return the quilt of each."""
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
    """Return the model with the texels of all of them; if `texels` is given, with so many at most."""
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
    """Return at how many texels for a step a quilt has its share of `texels`; None: as it is exported."""
    all_texels = sum(each.texels for each in coverings)
    if texels is None or texels >= all_texels:
        return None
    steps = sum(chart.height * chart.width for chart in quilt.charts)
    density = math.sqrt(texels * covering.texels / all_texels / steps)
    return min(max(density, PAINTED_DENSITIES[0]), PAINTED_DENSITIES[1])


def settled_values(coverings: Sequence[Covering]) -> dict[str, str]:
    """Return what was settled where nothing was asked for, in words; of several, a line by material."""
    found = {
        each.name: settled_words(each.prepared, each.surface, each.asked, each.roles) for each in coverings
    }
    if len(coverings) == 1 and not coverings[0].name:
        return found[""]
    return {
        name: "; ".join(f"{key} {value}" for key, value in words.items()) for name, words in found.items()
    }


def counted(coverings: Sequence[Covering], quilts: Sequence[Quilt], model: TexturedModel) -> dict[str, int]:
    """Return how many there are of what, over all of them."""
    counts = [counts_of(model.surface, quilt, model.texels) for quilt in quilts]
    summed = {name: sum(each[name] for each in counts) for name in _SUMMED}
    materials = {"materials": len(coverings)} if len(coverings) > 1 else {}
    return counts[0] | summed | {"maps": 1 + len(model.maps)} | materials


_SUMMED = ("charts", "texels", "painted texels", "placements", "edge blocks")
