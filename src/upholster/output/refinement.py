"""Files from a stream, or from its start."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import FormatError, InputError, check_whole
from upholster.base.files import Outputs, outputs, path_text, read_bytes
from upholster.base.limits import Limits
from upholster.base.options.choices import chosen
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray, Progress
from upholster.codec.stream.budget import check_chart_budget
from upholster.codec.stream.prefix import Limit, feed_until
from upholster.codec.stream.reader import StreamDecoder
from upholster.codec.stream.surface_swap import on_surface
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.built_in.catalog import SurfaceLike, as_surface, surface_file
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.same_edges import check_same_edges
from upholster.geometry.patches.surface import Surface
from upholster.image.files.material import Material
from upholster.image.files.source import source_parts
from upholster.image.roles import ROLES
from upholster.model.islands import pack_atlas
from upholster.model.packing import PAGE_LIMIT
from upholster.model.textured_model import TexturedModel, check_displacement, metres_of
from upholster.output.atlas_pages import PagedAtlas, write_page
from upholster.output.output_writer import files_of, listed, painted, written_to
from upholster.output.outputs import Output, parse_outputs
from upholster.output.reports import covering
from upholster.quilt.chart import MAX_TEXELS
from upholster.quilt.materials import WindowPainter
from upholster.quilt.painting import PAINTED_DENSITIES, painted_charts
from upholster.runtime.parallel import run_tasks, running

__all__ = ["RefineReport", "decoded_model", "received_exemplar", "refine"]


@dataclass(frozen=True, slots=True)
class RefineReport(Shown):
    """Report of `refine`. A notebook shows it as a picture of the model.

    Attributes
    ----------
    used, total
        Bytes of the stream that were used, and the length of the complete stream.
    complete
        Whether all were used.
    placements, coefficients
        Shares, 0 to 1, of placements that are known, and of significant coefficients; of a complete stream 1.
    written
        Bytes of each file.
    model
        The textured model itself; None if only UDIM tiles were written, one by one.
    """

    used: int
    total: int
    complete: bool
    placements: float
    coefficients: float
    written: dict[str, int]
    model: TexturedModel | None = None

    def __repr__(self) -> str:
        parts = {"used": self.used, "total": self.total, "written": list(self.written)}
        return on_a_line(self, parts)


def refine(
    stream: str | os.PathLike[str],
    targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    *,
    limit: Limit | None = None,
    on: SurfaceLike | None = None,
    texels: int | None = None,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    limits: Limits | None = None,
) -> RefineReport:
    """Write files from a stream, or from its start, as ``upholster refine`` does.

    Parameters
    ----------
    stream
        A .uph file, complete or cut.
    targets, options, threads, progress
        As for `cover`; of a material the maps that have arrived.
    limit
        How far to read.
    texels
        About how many texels the surface gets, 64 to 2^31: the same texture, painted more finely or coarsely;
        by default the number that the stream was made for. Its charts' sides are rounded to whole texels.
    limits
        Limits of the stream's demands, see `upholster.StreamDecoder`. By default 2^31 texels if only UDIM
        tiles of patches are written: these are painted one by one.
    on
        Another surface for the same texels, or its text form (see `upholster.surface_from_spec`): it must
        have the stream's faces, and their edges must meet in the same way. By default the stream's own.

    Raises
    ------
    InputError, FormatError
        If the file is missing, damaged, too short to show anything, or also a target: for a damaged one the
        message says how many bytes at its start are right. Or if the other surface does not fit: the message
        names the first edge that does not.
    """
    options = chosen(WriteOptions, options)
    stream = path_text(stream, "stream")
    if not isinstance(limit, Limit | None):
        raise InputError(f"limit is a {type(limit).__name__}; allowed: a Limit")
    wanted = parse_outputs(listed(targets), options)
    other = [file for file in [on is not None and surface_file(on)] if file]
    for output in wanted:
        if output.url:
            name = f"{output.url}/{output.path}"
            raise InputError(f"output {name!r} is a URL; allowed for a stream: a folder of this machine")
    with running(threads, progress), outputs(files_of(wanted), inputs=[stream, *other]) as files:
        data = read_bytes(stream)
        one_by_one = len(wanted) == 1 and wanted[0].in_tiles
        most = Limits(texels=MAX_TEXELS) if limits is None and one_by_one else limits
        decoder = StreamDecoder(limits=most)
        _feed(decoder, data, limit or Limit())
        if decoder.needed or decoder.surface is None:
            raise FormatError(f"byte {len(data)}: stream is cut; needs {max(1, decoder.needed)} more bytes")
        if on is not None and decoder.is_base:
            raise InputError(f"stream {stream!r} is cut before its surface; allowed with `on`: more of it")
        surface = decoder.surface if on is None else _other_surface(on, decoder.surface)
        one_by_one = one_by_one and isinstance(surface, Surface)
        if limits is None and not one_by_one:
            most = Limits()
            check_chart_budget(painted_charts(decoder.charts, decoder.density), most)
        density = _density(texels, surface, decoder, most or Limits())
        charts = painted_charts(decoder.charts, density)
        exemplar = received_exemplar(decoder)
        roles = tuple(source_parts(exemplar))[1:]
        files.add(files_of(wanted, roles))
        check_displacement(options, roles=roles, metres=metres_of(surface))
        with_atlas = any(output.kind.atlas for output in wanted)
        layout = pack_atlas(surface, charts, **options.packing) if with_atlas else None
        files.add(files_of(wanted, roles, layout))
        same = data if decoder.complete and not options.stream_choices else None
        if same is not None and on is not None:
            same = None if isinstance(surface, MeshSurface) else on_surface(same, surface)
        quilt = decoder.quilt().on(surface)
        if one_by_one:
            assert isinstance(surface, Surface)  # one_by_one implies it
            atlas, maps = PagedAtlas.of(surface, charts, options), source_parts(exemplar)
            painters = {role: WindowPainter(quilt, role, maps[role], density=density) for role in maps}
            written = _write_pages(wanted[0], atlas, painters, files, quality=options.quality)
            return _report(decoder, written, None)
        base, others = painted(quilt, exemplar, density=density)
        options = _as_coded(decoder, options)
        model = TexturedModel(
            surface,
            base,
            options,
            quilt,
            exemplar,
            others,
            same,
            density=density,
            packed=layout,
        )
        written = written_to(wanted, model, files, {})
    return _report(decoder, written, model)


def _feed(decoder: StreamDecoder, data: bytes, limit: Limit) -> None:
    """Feed a decoder; for a damaged stream the error says which start of it can be used."""
    try:
        feed_until(decoder, data, limit)
    except FormatError as error:
        if decoder.needed:
            raise
        part = f"its first {decoder.verified} bytes are right and show a model"
        raise FormatError(f"{error}; {part}: --bytes {decoder.verified}") from None


def _density(texels: int | None, surface: AnySurface, decoder: StreamDecoder, most: Limits) -> float:
    """Return the texels per step of the charts, each way, for which a surface has this many in all."""
    if texels is None:
        return decoder.density
    charts = decoder.charts
    check_whole("texels", texels, 64, MAX_TEXELS)
    steps = covering(surface, charts)
    density, (least, greatest) = math.sqrt(texels / steps), PAINTED_DENSITIES
    if not least <= density <= greatest:
        low, high = math.ceil(steps * least**2), math.floor(steps * greatest**2)
        raise InputError(f"texels is {texels}; allowed of this stream: {low} to {high}")
    count = sum(chart.height * chart.width for chart in painted_charts(charts, density))
    if refused := most.refusal("charts would have", "texels", count):
        raise InputError(refused)
    return density


def _report(decoder: StreamDecoder, written: dict[str, int], model: TexturedModel | None) -> RefineReport:
    (known, count), (placed, total) = decoder.coefficients_known, decoder.placements_known
    return RefineReport(
        decoder.used,
        decoder.total or decoder.received,
        decoder.complete,
        placed / total if total else float(decoder.plan_known),
        1.0 if decoder.complete else known / count,
        written,
        model,
    )


def _write_pages(
    output: Output,
    atlas: PagedAtlas,
    painters: Mapping[str, WindowPainter],
    files: Outputs,
    *,
    quality: int,
) -> dict[str, int]:
    """Paint and write the pages of an atlas one by one, one on each thread; return the bytes of each file."""
    pages = atlas.layout.pages
    targets = output.files([role for role in painters if role != "albedo"], len(pages))
    by_role = dict(zip(painters, np.array(targets, object).reshape(len(painters), -1), strict=True))

    def write(page: int) -> None:
        for role, painter in painters.items():
            pixels = atlas.painted(page, role, painter.paint)
            write_page(files.path(by_role[role][page]), role, pixels, quality=quality)

    tasks = [partial(write, page) for page in range(len(pages))]
    # If charts are larger than a page, only one should be in memory at a time: a stream may come from anyone.
    large = any(page.height * page.width > PAGE_LIMIT**2 for page in pages)
    run_tasks(tasks, threads=1 if large else None, stage="paint")
    return {str(target): files.path(target).stat().st_size for target in targets}


def _other_surface(on: SurfaceLike, before: AnySurface) -> Surface:
    """Return the surface that replaces a stream's own; `InputError` if it does not fit."""
    if isinstance(before, MeshSurface):
        raise InputError("the stream is of a mesh; allowed: another surface for streams of patches alone")
    if isinstance(on, Surface):
        name, surface = on.name or "surface", on
    else:
        quadratic = all(max(patch.degree) <= 2 for patch in before.patches)
        name, surface = str(on), as_surface(on, biquadratic=quadratic)
    try:
        check_same_edges(surface, before)
    except InputError as error:
        raise InputError(f"{name} does not fit the stream: {error}") from None
    return surface


def decoded_model(decoder: StreamDecoder) -> TexturedModel:
    """Return the model in the received part of a stream.

    Parameters
    ----------
    decoder
        A decoder that has received enough to show something.

    Raises
    ------
    InputError
        If bytes are still needed.
    """
    quilt, exemplar = decoder.quilt(), received_exemplar(decoder)
    texels, maps = painted(quilt, exemplar)
    assert quilt.surface is not None  # it comes before all that a quilt needs
    options = _as_coded(decoder, WriteOptions())
    return TexturedModel(quilt.surface, texels, options, quilt, exemplar, maps)


def _as_coded(decoder: StreamDecoder, options: WriteOptions) -> WriteOptions:
    """Return options with the stream's own profile, unless another one is requested."""
    return (
        replace(options, wavelet="haar") if decoder.wavelet == "haar" and options.wavelet is None else options
    )


def received_exemplar(decoder: StreamDecoder) -> PixelArray | Material:
    """Return the exemplar of a stream; maps of which nothing has arrived yet are left out."""
    maps = {"albedo": decoder.exemplar()}
    for role in decoder.roles[1:]:
        pixels = decoder.exemplar(role)
        # Such a map is the middle of its range everywhere: in a normal map that would not be a direction.
        if role in ROLES and (decoder.complete or (pixels != pixels[0, 0]).any()):
            maps[role] = pixels
    return Material(maps) if len(maps) > 1 else maps["albedo"]
