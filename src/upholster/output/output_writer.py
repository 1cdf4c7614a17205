"""Writing: `write`, and functions that it shares with `cover` and `refine`: painting, and all outputs."""

import math
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.files import Outputs, outputs
from upholster.base.formats import OUTPUTS, suffixes_of
from upholster.base.options.choices import chosen
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import PixelArray, Progress
from upholster.charts.surface_to_cover import CoveredLike, as_covered
from upholster.codec.image_code import check_image
from upholster.codec.stream.sample import fitting_side
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.image.files.material import Material
from upholster.image.files.source import Source, as_exemplar
from upholster.model.composite import joined_model
from upholster.model.packing import GUTTER, AtlasLayout
from upholster.model.textured_model import TexturedModel, textured_model
from upholster.output.outputs import Output, parse_outputs, write_output
from upholster.output.reports import timed
from upholster.quilt.materials import paint_material
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.painting import PAINTED_DENSITIES, paint
from upholster.runtime.parallel import quietly, running
from upholster.runtime.stages import stage

__all__ = [
    "check_coded",
    "check_directions",
    "check_several",
    "files_of",
    "has_stream",
    "listed",
    "notes_after",
    "painted",
    "quality_words",
    "write",
    "written_to",
]


def listed(
    targets: Sequence[str | os.PathLike[str]] | str | os.PathLike[str],
) -> list[str | os.PathLike[str]]:
    """Return targets as a list; a single one may be given by itself."""
    if isinstance(targets, (str, os.PathLike)):
        return [targets]
    if not isinstance(targets, Sequence) or not targets:
        raise InputError(f"targets are {on_a_line(targets)}; allowed: one file or several")
    return list(targets)


def files_of(
    wanted: Sequence[Output], roles: Sequence[str] = (), layout: AtlasLayout | None = None
) -> list[Path]:
    """Return the files of all outputs.

    Textures that an OBJ and a PLY of one name share are equal, and listed once. Any other duplicate is listed
    twice, and `upholster.base.files` refuses it. `roles` are as for `Output.files`. `layout` is the atlas's;
    None: one page.
    """
    pages = 1 if layout is None else len(layout.pages)
    found: list[Path] = []
    shared: set[Path] = set()
    for output in wanted:
        for file in output.files(roles, pages):
            is_shared = bool(output.kind.texture) and file not in output.own
            if not (is_shared and file in shared):
                found.append(file)
            if is_shared:
                shared.add(file)
    return found


def check_coded(wanted: Sequence[Output], parts: Mapping[str, PixelArray], options: WriteOptions) -> None:
    """Raise InputError if a stream is requested and can not hold the sample's maps."""
    if not has_stream(wanted):
        return
    if (side := fitting_side(parts.values())) is not None:
        height, width = parts["albedo"].shape[:2]
        raise InputError(
            f"the sample has {width}x{height} pixels, too many for a stream; allowed: with --resize {side}"
        )
    for part in parts.values():
        check_image(part, **options.transform)


def check_several(wanted: Sequence[Output], materials: Collection[object]) -> None:
    """Raise InputError if a stream is requested with several materials: it holds one sample."""
    if materials and has_stream(wanted):
        names = ", ".join(str(output.path) for output in wanted if output.kind.stream)
        allowed = ", ".join(suffixes_of(kind for kind in OUTPUTS if not kind.stream))
        raise InputError(f"{names} holds one sample, and several materials are given; allowed: {allowed}")


def check_directions(wanted: Sequence[Output], surface: AnySurface) -> None:
    """Raise InputError if a picture of directions is requested for a surface that is not a mesh."""
    for output in wanted:
        if output.kind.mesh and not isinstance(surface, MeshSurface):
            raise InputError(f"output {str(output.path)!r} shows directions; allowed: on a mesh")


def has_stream(wanted: Sequence[Output]) -> bool:
    """Whether one of the outputs holds a stream."""
    return any(output.kind.stream for output in wanted)


def quality_words(wanted: Sequence[Output], model: TexturedModel | None) -> dict[str, str]:
    """Return, if a stream was written, the quality of each map of the sample in dB, in words."""
    if model is None or not has_stream(wanted):
        return {}
    found = [
        f"{'sample' if role == 'albedo' else role} "
        + ("lossless" if quality == math.inf else f"at {quality:.1f} dB")
        for role, quality in model.sample_quality.items()
    ]
    return {"stream": ", ".join(found)}


def written_to(
    wanted: Sequence[Output], model: TexturedModel, files: Outputs, seconds: dict[str, float]
) -> dict[str, int]:
    """Write all outputs; return the bytes of each file, and add the time of each output to `seconds`."""
    written: dict[str, int] = {}
    for output in wanted:
        with timed(f"write {output.path.name}", seconds):
            shown = _coarser(model, output.lod) if output.lod else model
            own = write_output(output, shown, files)
        written |= {str(file): files.path(file).stat().st_size for file in own}
    return written


def notes_after(wanted: Sequence[Output], model: TexturedModel, seconds: dict[str, float]) -> list[str]:
    """Return notes about the written files: about a model's file, about a solid."""
    notes = list(model.notes)
    if any(output.kind.solid for output in wanted):
        with timed("check", seconds):
            notes += model.solid_notes()
    return notes


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
    with running(threads, progress):
        found = None if exemplar is None else as_exemplar(exemplar)
        model = textured_model(
            texels,
            surface=as_covered(surface, patches=_are_on_patches(texels)).surface,
            quilt=quilt,
            exemplar=found,
            options=options,
        )
        layout = model.layout if any(output.kind.atlas for output in wanted) else None
        with outputs(files_of(wanted, tuple(model.maps), layout)) as files:
            written_to(wanted, model, files, {})


def _are_on_patches(texels: Texels | Mapping[str, Texels]) -> bool:
    base = texels.get("albedo") if isinstance(texels, Mapping) else texels
    return isinstance(base, Texels) and isinstance(base.surface, Surface)


@stage
def painted(
    quilt: Quilt, exemplar: PixelArray | Material, *, density: float | None = None
) -> tuple[Texels, dict[str, Texels]]:
    """Return texels of the base colour, and of a material's other maps by role."""
    if not isinstance(exemplar, Material):
        return paint(quilt, exemplar, density=density), {}
    maps = paint_material(quilt, exemplar, density=density)
    return maps.pop("albedo"), maps


def _coarser(model: TexturedModel, halvings: int) -> TexturedModel:
    """Return a model painted again; textures, gutters and pages are halved `halvings` times each way."""
    if model.parts:
        return joined_model([_coarser(part, halvings) for part in model.parts])
    if model.quilt is None or model.exemplar is None:
        raise InputError("lods need a quilt and its sample, not only texels")
    density, size = max(PAINTED_DENSITIES[0], model.density / 2**halvings), model.options.atlas_size
    with quietly():
        texels, maps = painted(model.quilt, model.exemplar, density=density)
    padding = model.options.padding
    if padding is None and not isinstance(model.surface, MeshSurface):
        padding = GUTTER  # on a mesh it depends on the number of texels
    options = replace(
        model.options,
        padding=None if padding is None else padding >> halvings,
        atlas_size=None if size is None else max(256, size >> halvings),
    )
    return replace(model, texels=texels, maps=maps, density=density, options=options, packed=None)
