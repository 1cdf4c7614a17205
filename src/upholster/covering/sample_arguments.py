"""The samples of a request, as a caller gives them: checked before any file is read."""

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.formats import is_model_name
from upholster.base.options.sample_options import SampleOptions
from upholster.charts.surface_to_cover import CoveredLike
from upholster.image.files.source import Sample, Source
from upholster.image.files.write import IMAGE_SUFFIXES
from upholster.synthesis.guidance_reader import sized_sample

__all__ = ["check_not_swapped", "check_samples", "read_materials", "read_sample"]


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
