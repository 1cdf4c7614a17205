"""Read a request: its surface and samples, as one covering or, with several materials, one for each."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from upholster.charts.axis_directions import closed_rounds
from upholster.charts.directions import stroke_texts
from upholster.charts.layout import LONGEST, texture_scale
from upholster.charts.maps import parse_map
from upholster.charts.part_directions import is_by_part, part_direction, triangles_by_direction
from upholster.charts.surface_to_cover import Covered, as_covered, covered_parts
from upholster.coverings.covering import REST, Covering, naming_material
from upholster.coverings.pins import Pinned
from upholster.coverings.request import Request
from upholster.elements import find_lattice
from upholster.errors import InputError
from upholster.fitting import fitted
from upholster.geometry import MeshSurface
from upholster.geometry.mesh_files import ModelFile
from upholster.image import Material
from upholster.image.source import Sample, Source, read_source
from upholster.methods import (
    Guidance,
    given_guidance,
    kept_sample,
    matched_image,
    needs_patches,
    read_guidance,
    sample_width,
)
from upholster.options import SynthesisOptions
from upholster.shown import on_a_line
from upholster.types import PixelArray, Progress

__all__ = ["read_coverings"]


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
        with naming_material(pattern or REST):
            out.append(_covering(pattern, covered, own, _share(asked, covered, parts), largest))
    return out


def _covering(
    pattern: str | None, covered: Covered, sample: Sample, asked: SynthesisOptions, largest: int
) -> Covering:
    read_notes: list[str] = []
    source = read_source(sample, notes=read_notes)
    if isinstance(source, Material):
        prefix = "" if pattern is None else f"{pattern or REST}: "
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
