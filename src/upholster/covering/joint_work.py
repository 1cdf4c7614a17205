"""The work over the requests of all samples: quilts, the painted model, notes, automatic choices, counts."""

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from upholster.base.files import Outputs
from upholster.codec.stream.plan import refuse_pixel
from upholster.codec.stream.writer import check_layout
from upholster.covering.notes import notes_before
from upholster.covering.request import Request
from upholster.geometry.patches.surface import Surface
from upholster.image.files.source import source_parts
from upholster.image.roles import ROLES
from upholster.model.composite import joined_model, joined_surface
from upholster.model.islands import pack_atlas
from upholster.model.packing import AtlasLayout
from upholster.model.textured_model import TexturedModel, check_displacement, metres_of
from upholster.output.output_writer import (
    check_coded,
    check_directions,
    files_of,
    has_stream,
    listed,
    painted,
)
from upholster.output.outputs import Output, largest_chart, parse_outputs
from upholster.output.reports import automatic_words, counts_of, page_counts
from upholster.quilt.model import Quilt
from upholster.quilt.painting import PAINTED_DENSITIES
from upholster.runtime.parallel import reporting
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.quilt.scene import Scene

__all__ = [
    "atlas_layout",
    "automatic_values",
    "check_read",
    "check_streamed",
    "counted",
    "declare_files",
    "for_files",
    "laid_quilts",
    "painted_model",
    "read_notes",
    "roles_of",
    "share_of",
    "work_notes",
]


def read_notes(requests: Sequence[Request]) -> list[str]:
    """Return all warnings from reading."""
    return [note for each in requests for note in each.on_surface.notes]


def work_notes(requests: Sequence[Request], *, in_memory: bool = True) -> list[str]:
    """Return all warnings about the work ahead; `in_memory` says whether all texels will be in memory."""
    found = []
    for each in requests:
        maps, title = 1 + len(each.roles) if in_memory else 0, f"{each.name}: " if each.name else ""
        notes = notes_before(each.surface, each.scene, each.exemplar.parts[0], maps)
        found += [title + note for note in notes]
    return found


def roles_of(requests: Sequence[Request], *, all_have: bool = False) -> tuple[str, ...]:
    """Return the maps, other than the base colour, that at least one request has, or that all have."""
    has = all if all_have else any
    return tuple(role for role in ROLES if has(role in each.roles for each in requests))


def for_files(
    request: Request, targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str] | None = None
) -> Request:
    """Return a request for writing these files; without any, for a model like that in files.

    Raises
    ------
    InputError
        If one has an unknown suffix, or an option is given that none of them uses.
    """
    writing, found = request.writing, tuple[Output, ...]()
    if targets is not None:
        flat = isinstance(request.synthesis.texels, tuple)
        found = tuple(parse_outputs(listed(targets), writing, flat=flat))
        if writing.wavelet is None and request.synthesis.method == "paper":
            writing = replace(writing, wavelet="haar")
    return replace(request, writing=writing, outputs=found, largest=largest_chart(found, writing))


def declare_files(requests: Sequence[Request], files: Outputs) -> None:
    """Declare the model's files, which are read, and all maps' files; InputError if one is an input."""
    first = requests[0]
    if first.covered.model is not None:
        files.keep(first.covered.model.inputs)
    files.add(files_of(first.outputs, roles_of(requests)))


def check_read(requests: Sequence[Request]) -> None:
    """Check what is asked against the model and samples that were read.

    Raises
    ------
    InputError
        If an output can not hold it.
    """
    first = requests[0]
    wanted, writing, surface = first.outputs, first.writing, first.surface
    if isinstance(surface, Surface):
        _ = surface.shared  # find edges that are claimed twice now, not after the work
    check_directions(wanted, surface)
    check_coded(wanted, source_parts(first.source), writing)
    check_displacement(writing, roles=roles_of(requests, all_have=True), metres=metres_of(surface))


def check_streamed(requests: Sequence[Request], scenes: Sequence[Scene | PatchScene]) -> None:
    """Raise InputError if a stream is requested and can not hold this layout, or this method's quilt."""
    first = requests[0]
    if has_stream(first.outputs) and isinstance(first.surface, Surface):
        if first.synthesis.method == "pixel":
            refuse_pixel(first.texels, first.exemplar.shape)
        check_layout(first.surface, scenes[0].charts, first.exemplar.shape)


def atlas_layout(requests: Sequence[Request], scenes: Sequence[Scene | PatchScene]) -> AtlasLayout | None:
    """Return the places of the charts of all scenes in one atlas; None if no output has an atlas.

    Raises
    ------
    InputError
        If an option is out of range.
    """
    first = requests[0]
    if not any(output.kind.atlas for output in first.outputs):
        return None
    surface = joined_surface([each.surface for each in requests])
    charts = [chart for scene in scenes for chart in scene.painted]
    return pack_atlas(surface, charts, **first.writing.packing)


@contextmanager
def share_of(requests: Sequence[Request], number: int) -> Iterator[None]:
    """Report the progress of one of several requests, by their texels, as a share of that of all."""
    sizes = [each.texels for each in requests]
    if len(sizes) == 1:
        yield
        return
    start, size, total = sum(sizes[:number]), sizes[number], sum(sizes)
    with reporting(lambda stage, done, of: (stage, start + size * done // max(1, of), total)):
        yield


def laid_quilts(requests: Sequence[Request]) -> list[Quilt]:
    """Return the quilt of each request."""
    quilts = []
    for number, each in enumerate(requests):
        with share_of(requests, number):
            quilts.append(each.quilt())
    return quilts


def painted_model(
    requests: Sequence[Request], quilts: Sequence[Quilt], *, texels: int | None = None
) -> TexturedModel:
    """Return the model with the texels of all requests; at most `texels` of them, if given."""
    models = []
    for number, (each, quilt) in enumerate(zip(requests, quilts, strict=True)):
        with share_of(requests, number):
            models.append(_textured(each, quilt, _density(requests, each, quilt, texels)))
    return joined_model(models)


def _textured(request: Request, quilt: Quilt, density: float | None) -> TexturedModel:
    density = quilt.density if density is None else density
    texels, others = painted(quilt, request.source, density=density)
    return TexturedModel(
        request.surface, texels, request.writing, quilt, request.source, others,
        file=request.covered.model, field=request.scene.field, name=request.title, density=density,
    )  # fmt: skip


def _density(requests: Sequence[Request], request: Request, quilt: Quilt, texels: int | None) -> float | None:
    """Return the texels per step with which a quilt has its share of `texels`; None: as exported."""
    all_texels = sum(each.texels for each in requests)
    if texels is None or texels >= all_texels:
        return None
    steps = sum(chart.height * chart.width for chart in quilt.charts)
    density = math.sqrt(texels * request.texels / all_texels / steps)
    return min(max(density, PAINTED_DENSITIES[0]), PAINTED_DENSITIES[1])


def automatic_values(requests: Sequence[Request]) -> dict[str, str]:
    """Return automatic choices in words; for several materials, one line for each."""
    found = {
        each.name: automatic_words(each.scene, each.surface, each.on_surface.options, each.roles)
        for each in requests
    }
    if len(requests) == 1 and not requests[0].name:
        return found[""]
    return {
        name: "; ".join(f"{key} {value}" for key, value in words.items()) for name, words in found.items()
    }


def counted(requests: Sequence[Request], model: TexturedModel) -> dict[str, int]:
    """Return counts of charts, texels and the like, over all requests."""
    materials = {"materials": len(requests)} if len(requests) > 1 else {}
    return counts_of(model) | {"maps": 1 + len(model.maps)} | materials | page_counts(model)
