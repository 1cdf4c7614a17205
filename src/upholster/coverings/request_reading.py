"""Read a request: its surface and samples, as one covering or, with several materials, one for each."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from upholster.charts.layout import LONGEST
from upholster.charts.maps import parse_map
from upholster.charts.surface_to_cover import Covered, covered_parts
from upholster.coverings.covering import REST, Covering, naming_material
from upholster.coverings.pins import Pinned
from upholster.coverings.request import Request
from upholster.errors import InputError
from upholster.geometry import MeshSurface
from upholster.image import Material
from upholster.image.source import Sample, Source, read_source
from upholster.methods import Guidance, covered_by_method, given_guidance, settled
from upholster.options import SynthesisOptions
from upholster.types import Progress

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
        covered = covered_by_method(on, asked, reading, progress=progress)
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
    notes = list(covered.notes)
    source = read_source(sample, notes=notes)
    if isinstance(source, Material):
        prefix = "" if pattern is None else f"{pattern or REST}: "
        notes += [prefix + note for note in source.notes]
    found = settled(sample, source, covered, asked)
    title = "" if pattern is None else _title(sample.source, pattern)
    return Covering(
        pattern, covered, found.source, found.options, title, largest, found.guidance,
        notes=(*notes, *found.notes),
    )  # fmt: skip


def _with_pins(covering: Covering, sample: Sample, pinned: Pinned | None) -> Covering:
    # Returns a covering with regions that stay as they were.
    if pinned is None:
        return covering
    before = _covering(None, covering.covered, sample, pinned.synthesis, covering.largest)
    held = (_with_pins(before, sample, pinned.before), pinned.seed)
    regions = replace(covering.guidance or Guidance(), held=tuple(map(parse_map, pinned.regions)))
    return replace(covering, guidance=regions, held=held)


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
