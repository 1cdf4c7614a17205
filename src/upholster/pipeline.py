"""The whole flow on one screen: exemplar and surface, layout and synthesis, painting, files.

exemplar, surface ──► prepare ──► execute ──► quilt ──► paint ──► texels ──► mesh, atlas ──► files
"""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from upholster._version import __version__
from upholster.codec import check_image
from upholster.errors import FormatError, InputError
from upholster.files import Outputs, outputs, path_text, read_bytes
from upholster.geometry import Surface, SurfaceLike, as_surface, check_same_edges, surface_file
from upholster.image import Material
from upholster.image.rectify import Corners
from upholster.image.roles import ROLES
from upholster.image.source import Source, as_exemplar, read_source, source_files, source_names, source_parts
from upholster.methods import Prepared, execute, kept_sample, matched_image, prepare, settled_seed
from upholster.methods.paper.method import PaperOptions
from upholster.methods.pixel.method import PixelOptions
from upholster.methods.quilt.options import QuiltOptions
from upholster.options import SampleOptions, SynthesisOptions, WriteOptions, chosen
from upholster.outputs import (
    Output,
    TexturedModel,
    atlas_pages,
    parse_output,
    textured_model,
    write_output,
)
from upholster.parallel import check_running
from upholster.quilt import Quilt, Texels, paint, paint_material
from upholster.quilt.plans import StripPlan
from upholster.quilt.warp_field import WarpField
from upholster.shown import Shown, on_a_line
from upholster.stream import StreamDecoder, check_layout, on_surface
from upholster.stream.plans import refuse_source_map
from upholster.stream.prefix import Limit, feed_until
from upholster.types import PixelArray, Progress

__all__ = [
    "CoverReport",
    "RefineReport",
    "cover",
    "decoded_model",
    "painted",
    "received_exemplar",
    "refine",
    "write",
]

_SOFT = 0.6
"""Pixels of the sample to a texel below which a texture looks soft."""

_MANY_TEXELS = 2**25
"""From here on the size of what will be written is told before the work begins."""


@dataclass(frozen=True, slots=True)
class CoverReport(Shown):
    """What `cover` did; `--report` writes it as JSON. A notebook shows it as a picture of the model.

    Attributes
    ----------
    version
        Of upholster.
    parameters
        Everything that was asked for, defaults and seed included.
    settled
        What was chosen where nothing was asked for, in words: block, sample's size, direction, maps; with
        method "paper" patches, texels, block, overlap, edge block.
    counts
        Faces, patches, shared edges, charts, texels, placements, edge blocks; maps; of the base colour
        channels and bits per sample.
    seconds
        Time per stage, and "total".
    peak_memory_bytes
        Most memory that the process has held at once; None where the system does not tell.
    written
        Bytes of each file.
    notes
        What the user should know, in words: how a material's maps were read, how many edges nearly
        meet, that the texture will be soft, or that there will be very many texels.
    model
        The textured model itself; not in the JSON.
    """

    version: str
    parameters: dict[str, Any]
    settled: dict[str, str]
    counts: dict[str, int]
    seconds: dict[str, float]
    peak_memory_bytes: int | None
    written: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    model: TexturedModel | None = None

    def __repr__(self) -> str:
        return on_a_line(self, {"texels": self.counts["texels"], "written": list(self.written)})

    def to_json(self) -> dict[str, Any]:
        """Return all but the model, as JSON can hold it."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name != "model"}


def cover(
    exemplar: Source,
    on: SurfaceLike,
    targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
    *,
    maps: Mapping[str, str | os.PathLike[str]] | None = None,
    normal: str | None = None,
    rectify: Corners | None = None,
    crop: tuple[int, int, int, int] | None = None,
    resize: int | str | tuple[int, int] | None = None,
    even_light: bool = False,
    synthesis: SynthesisOptions | Mapping[str, Any] | None = None,
    seed: int | None = 0,
    options: WriteOptions | None = None,
    report: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
) -> CoverReport:
    """Cover a surface with an exemplar and write the results: what the command ``upholster cover`` does.

    Parameters
    ----------
    exemplar
        Image file, see `upholster.read_exemplar`. Or a material: a folder or zip file with its maps, several
        files named by role, files by role (see `upholster.read_material`, also for `maps` and `normal`), or
        the material itself. Its maps are matched together (by methods "paper" and "pixel": the base colour
        alone), and one quilt paints them all.
    on
        Which surface: a text, see `upholster.surface_from_spec`, a file's path, or a `Surface`. With method
        "paper" a sphere is of octants, unless it says otherwise.
    targets
        Files to write, one or several, by suffix, none of them one that is read; ``atlas:``
        before an image's path writes the
        atlas instead of a picture. With texels of width × height images are the flat texture itself. A
        material's other maps lie beside atlas, flat texture and OBJ, named by role: ``wall_normal.png``
        beside ``wall.png``; pictures of the model show all of them but the height. An atlas above 8192² has
        several pages: in a GLB each is a material, images are ``wall_1.png``, ``wall_2.png`` … An image with
        ``<UDIM>`` in its name is an atlas in UDIM tiles; texture coordinates of an OBJ then fit them.
    rectify, crop, resize, even_light
        How the exemplar is prepared, see `upholster.read_exemplar`.
    synthesis
        How it is covered: `upholster.SynthesisOptions`, or some of them by name.
    seed
        As there; None: a random one, which the report tells.
    options
        How models and pictures are written.
    report
        Where to write the report as JSON: a file that ends in ``.json``.
    threads, progress
        As in `upholster.synthesize`; stages "blocks", "seams" or "texels", then "paint" and "render".
    tell
        Called with each note of the report before the work begins.

    Returns
    -------
    CoverReport
        Parameters, counts and times.

    Raises
    ------
    InputError, FormatError
        Before any work where possible; nothing is written then.
    """
    options, seed = chosen(WriteOptions, options), settled_seed(seed)
    asked = chosen(SynthesisOptions, synthesis)
    check_running(threads, progress)
    wanted = [parse_output(target, flat=isinstance(asked.texels, tuple)) for target in _listed(targets)]
    if report is not None and not path_text(report, "report").lower().endswith(".json"):
        raise InputError(f"report {os.fspath(report)!r} has suffix {Path(report).suffix!r}; allowed: .json")
    preparing = SampleOptions(rectify=rectify, crop=crop, resize=resize, even_light=even_light)
    notes: list[str] = []
    seconds: dict[str, float] = {}
    if maps is not None and not isinstance(maps, Mapping):
        raise InputError(f"maps is a {type(maps).__name__}; allowed: files by role")
    read = [*source_files(exemplar, maps), *([file] if (file := surface_file(on)) else [])]
    _check_used(wanted, options)
    if asked.method == "paper" and options.wavelet is None:
        options = replace(options, wavelet="haar")
    own = [file for output in wanted for file in output.files()]
    with outputs([*own, *([report] if report else [])], inputs=read) as files:
        with _timed("read", seconds):
            surface = as_surface(on, biquadratic=asked.method == "paper")
            _ = surface.shared  # edges that are claimed twice are found now, not after the work
            source = read_source(exemplar, preparing, maps=maps, normal=normal, notes=notes)
        notes += source.notes if isinstance(source, Material) else ()
        parts = source_parts(source)
        roles = tuple(parts)[1:]
        files.add(file for output in wanted for file in output.later_files(roles, 1))
        _check_coded(wanted, parts, options)
        with _timed("prepare", seconds):
            source = kept_sample(source, asked)
            seen = matched_image(source, asked.method)
            prepared = prepare(seen, surface, asked)
            if _has_stream(wanted):
                if asked.method == "pixel":
                    refuse_source_map(
                        sum(chart.height * chart.width for chart in prepared.charts), seen.shape[:2]
                    )
                fields = prepared.fields or (WarpField.identity(),) * len(prepared.charts)
                check_layout(surface, prepared.charts, fields, (seen.shape[0], seen.shape[1]))
            _add_pages(files, wanted, roles, atlas_pages(wanted, prepared.charts, options))
        notes += _notes(surface, prepared, seen, len(parts))
        if tell is not None:
            for note in notes:
                tell(note)
        with _timed("synthesize", seconds):
            quilt = execute(prepared, seen, surface, seed=seed, threads=threads, progress=progress)
        with _timed("paint", seconds):
            texels, others = painted(quilt, source, threads, progress)
        tiles = any(output.in_tiles for output in wanted)
        model = TexturedModel(surface, texels, options, threads, quilt, source, others, in_tiles=tiles)
        written = _written(wanted, model, files, seconds, progress)
        parameters = {"exemplar": source_names(exemplar), "on": _surface_name(on), "threads": threads}
        parameters |= {"maps": source_names(maps or {}), "normal": normal}
        parameters |= asdict(preparing) | asdict(asked) | {"seed": seed} | asdict(options)
        if callable(parameters["direction"]):
            parameters["direction"] = prepared.direction
        result = CoverReport(
            __version__,
            parameters,
            _settled(prepared, surface, asked, roles),
            _counts(surface, quilt, texels) | {"maps": 1 + len(others)},
            _totalled(seconds),
            peak_memory(),
            written,
            notes,
            model,
        )
        if report:
            files.path(report).write_text(json.dumps(result.to_json(), indent=2) + "\n", encoding="utf-8")
    return result


def _listed(
    targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
) -> list[str | os.PathLike[str]]:
    """Return targets as a list: one of them may stand alone."""
    if isinstance(targets, (str, os.PathLike)):
        return [targets]
    if not isinstance(targets, Sequence) or not targets:
        raise InputError(f"targets are {on_a_line(targets)}; allowed: one file or several")
    return list(targets)


def _surface_name(on: SurfaceLike) -> str:
    return repr(on) if isinstance(on, Surface) else os.fspath(on)


@dataclass(frozen=True, slots=True)
class RefineReport(Shown):
    """What `refine` did. A notebook shows it as a picture of the model.

    Attributes
    ----------
    used, total
        Bytes of the stream that were read, and that it has when whole.
    complete
        Whether they are all.
    charts, coefficients
        Shares, 0 to 1, of charts whose placements are known and of significant coefficients.
    written
        Bytes of each file.
    model
        The textured model itself.
    """

    used: int
    total: int
    complete: bool
    charts: float
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
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> RefineReport:
    """Write files from a stream, or from as much of one as there is: what ``upholster refine`` does.

    Parameters
    ----------
    stream
        A .uph file, whole or cut.
    targets, options, threads, progress
        As for `cover`; a material's maps as far as they have come.
    limit
        How far to read.
    on
        Another surface for the same texels, or its text form (see `upholster.surface_from_spec`): it must
        have the stream's faces, and their edges must meet in the same way. By default the stream's own.

    Raises
    ------
    InputError, FormatError
        If the file is missing, damaged, so short that nothing can be shown, or also a target; or if the other
        surface does not fit: names the first edge that does not.
    """
    options = chosen(WriteOptions, options)
    check_running(threads, progress)
    stream = path_text(stream, "stream")
    if not isinstance(limit, Limit | None):
        raise InputError(f"limit is a {type(limit).__name__}; allowed: a Limit")
    wanted = [parse_output(target) for target in _listed(targets)]
    other = [file for file in [on is not None and surface_file(on)] if file]
    _check_used(wanted, options)
    with outputs([file for output in wanted for file in output.files()], inputs=[stream, *other]) as files:
        data = read_bytes(stream)
        decoder = StreamDecoder()
        feed_until(decoder, data, limit or Limit())
        if decoder.needed or decoder.surface is None:
            raise FormatError(f"byte {len(data)}: stream is cut; needs {max(1, decoder.needed)} more bytes")
        surface = decoder.surface if on is None else _other_surface(on, decoder.surface)
        exemplar = received_exemplar(decoder)
        roles = tuple(source_parts(exemplar))[1:]
        files.add(file for output in wanted for file in output.later_files(roles, 1))
        _add_pages(files, wanted, roles, atlas_pages(wanted, decoder.charts, options))
        same = data if decoder.complete and not options.stream_choices else None
        if same is not None and on is not None:
            same = on_surface(same, surface)
        quilt = decoder.quilt().on(surface)
        texels, maps = painted(quilt, exemplar, threads, progress)
        options = _as_coded(decoder, options)
        tiles = any(output.in_tiles for output in wanted)
        model = TexturedModel(surface, texels, options, threads, quilt, exemplar, maps, same, tiles)
        written = _written(wanted, model, files, {}, progress)
    known, count = decoder.coefficients_known
    return RefineReport(
        decoder.received,
        decoder.total or decoder.received,
        decoder.complete,
        decoder.charts_known / len(decoder.charts),
        known / count,
        written,
        model,
    )


def _other_surface(on: SurfaceLike, before: Surface) -> Surface:
    """Return the surface that takes the place of a stream's own; `InputError` where it does not fit."""
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


def decoded_model(decoder: StreamDecoder, *, threads: int | None = None) -> TexturedModel:
    """Return the model that a stream shows, as far as it has come.

    Parameters
    ----------
    decoder
        Which has enough of a stream to show something.
    threads
        As for `refine`.

    Raises
    ------
    InputError
        If bytes are still needed.
    """
    quilt, exemplar = decoder.quilt(), received_exemplar(decoder)
    texels, maps = painted(quilt, exemplar, threads, None)
    assert quilt.surface is not None  # it comes before all that a quilt needs
    options = _as_coded(decoder, WriteOptions())
    return TexturedModel(quilt.surface, texels, options, threads, quilt, exemplar, maps)


def _as_coded(decoder: StreamDecoder, options: WriteOptions) -> WriteOptions:
    """Return options by which a stream keeps the profile that it was read in, unless another is asked for."""
    return (
        replace(options, wavelet="haar") if decoder.wavelet == "haar" and options.wavelet is None else options
    )


def write(
    target: str | os.PathLike[str],
    surface: SurfaceLike,
    texels: Texels | Mapping[str, Texels],
    *,
    quilt: Quilt | None = None,
    exemplar: PixelArray | Material | Source | None = None,
    flat: bool = False,
    options: WriteOptions | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Write a textured surface to one file: .glb, .obj, .npz, .uph, .html, or a picture (.png …).

    Parameters
    ----------
    target
        The file; ``atlas:`` before an image's path writes the atlas instead of a picture.
    surface
        The surface; or its text form, or the path of its file.
    texels
        Its texels, as `upholster.paint` makes them, or a material's by role, of `upholster.paint_material`.
    quilt, exemplar
        What the texels were painted from, of a material the material: streams (.uph, .html) hold them
        instead. By default what the texels know themselves.
    flat
        Whether an image is the texels of the only chart, not a picture of the model.
    options
        Mesh, texture format and picture, see `upholster.WriteOptions`.
    threads, progress
        As in `upholster.synthesize`; stage "render" for pictures.

    Raises
    ------
    InputError
        For an unknown suffix, a place that cannot be written, texels of another surface, or without the role
        "albedo".
    """
    output = parse_output(target, flat=flat)
    check_running(threads, progress)
    options = chosen(WriteOptions, options)
    _check_used([output], options)
    found = None if exemplar is None else as_exemplar(exemplar)
    model = textured_model(
        texels,
        surface=as_surface(surface),
        quilt=quilt,
        exemplar=found,
        options=options,
        threads=threads,
    )
    pages = atlas_pages([output], model.texels.charts, options)
    with outputs(output.files(model.maps, pages)) as files:
        write_output(output, model, files, progress=progress)


def _check_used(wanted: Sequence[Output], options: WriteOptions) -> None:
    """Raise InputError where options are chosen for streams, and none is written."""
    if options.stream_choices and not _has_stream(wanted):
        names = ", ".join(str(output.path) for output in wanted)
        raise InputError(
            f"{options.stream_choices[0]} is for streams, and {names} is none; allowed: with .uph or .html"
        )


def _add_pages(files: Outputs, wanted: Sequence[Output], roles: Sequence[str], pages: int) -> None:
    """Announce the files of an atlas's further pages, which are known once the charts are."""
    for output in wanted:
        known = (*output.files(), *output.later_files(roles, 1))
        files.add(file for file in output.later_files(roles, pages) if file not in known)


def _check_coded(wanted: Sequence[Output], parts: Mapping[str, PixelArray], options: WriteOptions) -> None:
    """Raise InputError where a stream is wanted and can not hold the sample's maps."""
    if _has_stream(wanted):
        for part in parts.values():
            check_image(part, **options.transform)


def _has_stream(wanted: Sequence[Output]) -> bool:
    return any(output.kind in ("uph", "html") for output in wanted)


def _written(
    wanted: Sequence[Output],
    model: TexturedModel,
    files: Outputs,
    seconds: dict[str, float],
    progress: Progress | None,
) -> dict[str, int]:
    """Write all outputs; return the bytes of each file, and add the time of each output to `seconds`."""
    written: dict[str, int] = {}
    for output in wanted:
        with _timed(f"write {output.path.name}", seconds):
            write_output(output, model, files, progress=progress)
        pages = len(model.atlas.pages) if output.has_atlas else 1
        own = output.files(model.maps, pages)
        written |= {str(file): files.path(file).stat().st_size for file in own}
    return written


def painted(
    quilt: Quilt,
    exemplar: PixelArray | Material,
    threads: int | None = None,
    progress: Progress | None = None,
) -> tuple[Texels, dict[str, Texels]]:
    """Return texels of the base colour, and of a material's other maps by role."""
    if not isinstance(exemplar, Material):
        return paint(quilt, exemplar, threads=threads, progress=progress), {}
    maps = paint_material(quilt, exemplar, threads=threads, progress=progress)
    return maps.pop("albedo"), maps


def received_exemplar(decoder: StreamDecoder) -> PixelArray | Material:
    """Return what a stream was made from; maps of which nothing has come yet are left out."""
    maps = {"albedo": decoder.exemplar()}
    for role in decoder.roles[1:]:
        pixels = decoder.exemplar(role)
        # The middle of its range everywhere: of a normal map that would be no direction at all.
        if role in ROLES and (decoder.complete or (pixels != pixels[0, 0]).any()):
            maps[role] = pixels
    return Material(maps) if len(maps) > 1 else maps["albedo"]


@contextmanager
def _timed(stage: str, seconds: dict[str, float]) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def _totalled(seconds: dict[str, float]) -> dict[str, float]:
    return {stage: round(value, 4) for stage, value in [*seconds.items(), ("total", sum(seconds.values()))]}


def _settled(
    prepared: Prepared, surface: Surface, asked: SynthesisOptions, roles: Sequence[str]
) -> dict[str, str]:
    found: dict[str, str] = {}
    if isinstance(prepared.options, QuiltOptions):
        found["block"] = f"{prepared.options.block} pixels"
    if isinstance(prepared.options, PaperOptions):
        found |= _settled_by_paper(prepared.options, surface)
    if isinstance(prepared.options, PixelOptions):
        found["search"] = prepared.options.search
    if prepared.scale is not None:
        size = prepared.scale.sample_size
        found["sample"] = f"{size:.4g} units wide on a model of {surface.size:.4g}"
        if asked.sample_size is None:
            found["sample"] += f" (--sample-size {2 * size:.3g} makes it twice as large)"
        found["direction"] = prepared.direction
    if roles:
        found["maps"] = ", ".join(("albedo", *roles))
    return found


def _settled_by_paper(options: PaperOptions, surface: Surface) -> dict[str, str]:
    degrees = sorted({patch.degree for patch in surface.patches})
    named = " and ".join(f"({m}, {n})" for m, n in degrees)
    found = {
        "patches": f"{len(surface.patches)} of degree {named}",
        "texels": f"{options.chart}x{options.chart} on each",
        "block": f"{options.block} texels",
        "overlap": f"{options.overlap} texels",
    }
    if options.seams:
        found["edge block"] = f"{options.edge_block or options.block} texels"
    return found


def _edge_blocks(quilt: Quilt) -> int:
    if not isinstance(quilt.plan, StripPlan):
        return 0
    layout = quilt.plan.layout
    return sum(layout.blocks_along(strip) for strip in layout.strips)


def _notes(surface: Surface, prepared: Prepared, sample: PixelArray, maps: int) -> list[str]:
    """Return what the user should know before the work begins."""
    found = []
    count, tolerance = surface.nearly_meeting
    if count:
        found.append(
            f"{count} edges nearly meet, but are farther apart than the tolerance of {surface.tolerance:g} "
            f"times the surface's size; a tolerance of {tolerance:g} would join them"
        )
    if prepared.scale is not None and prepared.scale.scale < _SOFT * prepared.scale.density:
        pixels = prepared.scale.scale / prepared.scale.density
        found.append(
            f"the sample has {pixels:.2g} pixels to a texel, so the texture will be soft: a larger sample, a "
            "smaller --sample-size or fewer texels make it sharp"
        )
    texels = sum(chart.height * chart.width for chart in prepared.charts)
    if texels > _MANY_TEXELS:
        size = texels * sample.itemsize * 3 * maps
        found.append(
            f"{texels:,} texels: {size / 1e9:.1f} GB of texels in memory, and images of about half of that; "
            "fewer by --texels or --density"
        )
    return found


def _counts(surface: Surface, quilt: Quilt, texels: Texels) -> dict[str, int]:
    sample = texels.arrays[0]
    return {
        "faces": len(surface.faces),
        "patches": len(surface.patches),
        "shared edges": len(surface.shared),
        "charts": len(quilt.charts),
        "texels": quilt.texel_count,
        "placements": len(quilt.placements),
        # An edge block lies on two charts.
        "edge blocks": _edge_blocks(quilt),
        "channels": sample.shape[2],
        "bits": 8 * sample.itemsize,
    }


def peak_memory() -> int | None:
    """Return the most memory that this process has held at once, in bytes; None if the system is silent."""
    if sys.platform == "linux":
        # What getrusage tells on Linux may be the parent's peak, from before this program was loaded.
        with open("/proc/self/status", encoding="ascii") as file:
            return next((1024 * int(line.split()[1]) for line in file if line.startswith("VmHWM:")), None)
    if sys.platform == "win32":
        return None
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # in bytes on macOS
