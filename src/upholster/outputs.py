"""What can be written, by suffix: textured models, streams, pages, pictures, atlases, texels, solids."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upholster.charts.directions import DirectionField
from upholster.charts.layout import LONGEST
from upholster.charts.seams import ChartSeam, find_seams
from upholster.conditions import read_conditions
from upholster.errors import InputError
from upholster.export import (
    UDIM,
    Cover,
    ObjPart,
    check_usd,
    map_companion,
    obj_companions,
    page_files,
    ply_companion,
    udim_tile,
    write_3mf,
    write_bare_obj,
    write_bare_ply,
    write_glb,
    write_html,
    write_map,
    write_npz,
    write_obj,
    write_ply,
    write_retextured_glb,
    write_stl,
    write_usdz,
)
from upholster.files import Outputs
from upholster.geometry import AnySurface, MeshSurface
from upholster.geometry.mesh_files import ModelFile
from upholster.image import Material, encode_image, from_linear, write_image
from upholster.image.source import source_parts
from upholster.lengths import parse_length
from upholster.measure import Solid, check_solid, shown_length, solid_lines
from upholster.model import (
    Atlas,
    AtlasLayout,
    DisplacedMesh,
    Mesh,
    build_atlas,
    build_normal_atlas,
    charted_mesh,
    charted_tangents,
    displaced,
    kept_box,
    pack_surface,
    plain_solid,
    tessellate,
    vertex_tangents,
)
from upholster.model.packing import GUTTER
from upholster.options import WriteOptions
from upholster.quilt import Chart, Quilt, Texels
from upholster.redrawn import redrawn
from upholster.render import render
from upholster.render.directions import directions_picture
from upholster.render.maps import SHOWN
from upholster.shown import Shown, number_of, on_a_line
from upholster.stream import encode_stream
from upholster.types import FloatArray, PixelArray, Progress

__all__ = [
    "Output",
    "TexturedModel",
    "atlas_layout",
    "check_displacement",
    "largest_chart",
    "metres_of",
    "parse_output",
    "parse_outputs",
    "textured_model",
    "write_output",
]

Kind = Literal[
    "glb", "usdz", "obj", "ply", "npz", "uph", "html", "atlas", "flat", "picture", "solid", "directions"
]

_MODEL_SUFFIXES: dict[str, Kind] = {
    ".glb": "glb",
    ".usdz": "usdz",
    ".obj": "obj",
    ".ply": "ply",
    ".npz": "npz",
    ".uph": "uph",
    ".html": "html",
    ".stl": "solid",
    ".3mf": "solid",
}
_DISPLACED_SUFFIXES = (".obj", ".ply")
"""Models that hold triangles alone where these are displaced."""

_TILE_LIMIT = 4096
"""Texels of the largest chart on tiles, gutters included, where their size is not asked for."""

_POSTER_SIZE, _POSTER_VIEW, _POSTER_QUADS, _POSTER_QUALITY = (320, 240), (30.0, 30.0), 4000, 20
"""Of a page's poster: the viewer begins with this view."""

_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".exr")


@dataclass(frozen=True, slots=True)
class Output:
    """One thing to write: what it holds and where it goes.

    Attributes
    ----------
    kind
        A model or texels (glb, usdz, obj, ply, npz, uph, and html, which is a stream with its viewer), an
        image of all charts (atlas), the texels of a single chart (flat), a picture of the model, or its
        triangles alone, displaced where the options say so (solid).
    path
        The file; some kinds have others beside it.
    url
        Of the folder where it lies; empty: `path` is a path.
    lod
        Of a GLB: how often its textures are halved each way.
    """

    kind: Kind
    path: Path
    url: str = ""
    lod: int = 0

    @property
    def has_atlas(self) -> bool:
        """Whether it holds an atlas, which may have several pages."""
        return self.kind in ("glb", "usdz", "obj", "ply", "atlas")

    @property
    def has_pages(self) -> bool:
        """Whether the pages of its atlas are files of their own."""
        return self.kind in ("obj", "ply", "atlas")

    @property
    def in_tiles(self) -> bool:
        """Whether its pages are tiles of UDIM."""
        return UDIM in self.path.name

    def files(self, roles: Iterable[str] = (), pages: int = 1) -> tuple[Path, ...]:
        """Return every file that it consists of: textures after the model, the base colour's first.

        Parameters
        ----------
        roles
            Of a material's maps beside the base colour, see `TexturedModel.maps`.
        pages
            Of the atlas, see `atlas_layout`.
        """
        if self.url:
            return ()  # no file of this machine
        own: list[Path] = []
        match self.kind:
            case "atlas":
                texture = self.path
            case "flat":
                texture, pages = self.path, 1
            case "obj":
                material, texture = obj_companions(self.path)
                own = [self.path, material]
            case "ply":
                texture, own = ply_companion(self.path), [self.path]
            case _:
                return (self.path,)
        textures = [texture, *(map_companion(texture, role) for role in roles)]
        return (*own, *(file for path in textures for file in page_files(path, pages)))

    def later_files(self, roles: Iterable[str], pages: int) -> tuple[Path, ...]:
        """Return those files that are known only once the roles and the number of pages are."""
        first = self.files()
        return tuple(file for file in self.files(roles, pages) if file not in first)


def atlas_layout(
    outputs: Iterable[Output], surface: AnySurface, charts: Sequence[Chart], options: WriteOptions
) -> AtlasLayout | None:
    """Return where charts lie in the atlas; None where no output holds it.

    Raises
    ------
    InputError
        If the charts do not fit the atlas that the options ask for.
    """
    if not any(output.has_atlas for output in outputs):
        return None
    return pack_surface(surface, charts, **options.packing)


def largest_chart(outputs: Iterable[Output], options: WriteOptions) -> int:
    """Return how long charts may be, in texels: on tiles and pages whose size is told each must fit one."""
    if options.atlas_size is None and not any(output.in_tiles for output in outputs):
        return LONGEST
    padding = GUTTER if options.padding is None else options.padding
    step = 1 << max(0, padding.bit_length() - 1)
    size = _TILE_LIMIT if options.atlas_size is None else options.atlas_size
    return max(1, min(LONGEST, size // step * step - 2 * padding))


def metres_of(surface: AnySurface) -> float | None:
    """Return the length of a model unit in metres; None where it is not known."""
    return surface.mesh.metres if isinstance(surface, MeshSurface) else None


def check_displacement(
    outputs: Iterable[Output], options: WriteOptions, *, roles: Iterable[str], metres: float | None
) -> None:
    """Raise InputError, before any work, where a model can not be displaced as the options say.

    Parameters
    ----------
    outputs, options
        What is written: one of the outputs must be a solid.
    roles
        Of the sample's maps.
    metres
        Length of a model unit in metres; None where it is not known.
    """
    if options.displace is None:
        return
    names = [str(output.path) for output in outputs if output.kind != "solid"]
    if all(output.kind != "solid" for output in outputs):
        raise InputError(
            f"displace is for .stl, .3mf, .obj and .ply, and {', '.join(names)} is none; allowed: with those"
        )
    if options.displace_by == "height" and "height" not in roles:
        raise InputError(
            "displace needs a height map, and the sample has none; allowed: a material with one, or "
            "displace_by 'luminance'"
        )
    parse_length(options.displace, metres, name="displace")
    kept_box(read_conditions(options.keep) if options.keep else (), metres)


def parse_outputs(
    targets: Iterable[str | os.PathLike[str]], options: WriteOptions, *, flat: bool = False
) -> list[Output]:
    """Read outputs as `parse_output` does; after each GLB come its further files, see `WriteOptions.lods`.

    Raises
    ------
    InputError
        As there; and if a GLB is to have further files, and no output is one.
    """
    displaced, lods = options.displace is not None, options.lods
    outputs = [parse_output(target, flat=flat, displaced=displaced) for target in targets]
    if lods > 1 and all(output.kind != "glb" for output in outputs):
        names = ", ".join(str(output.path) for output in outputs)
        raise InputError(f"lods is for .glb, and {names} is none; allowed: with one")
    return [
        each
        for output in outputs
        for each in (
            output,
            *(
                replace(output, path=output.path.with_stem(f"{output.path.stem}_lod{k}"), lod=k)
                for k in range(1, lods if output.kind == "glb" else 1)
            ),
        )
    ]


def parse_output(target: str | os.PathLike[str], *, flat: bool = False, displaced: bool = False) -> Output:
    """Read an output as the command line has it: a path, or ``atlas:`` or ``directions:`` and a path.

    An image with ``<UDIM>`` in its name is an atlas, too: in tiles, each a file with its number there. One
    that is called ``directions`` shows the direction field of a mesh.

    Parameters
    ----------
    target
        What the user wrote.
    flat
        Whether images are a flat texture's texels, and no pictures of a model.
    displaced
        Whether OBJ and PLY are triangles alone, displaced.

    Raises
    ------
    InputError
        For an unknown suffix, ``<UDIM>`` where there can be no tiles, or what is not installed.
    """
    if not isinstance(target, (str, os.PathLike)):
        raise InputError(f"output is a {type(target).__name__}; allowed: a path, as text or pathlib.Path")
    text = os.fspath(target)
    atlas, directions = text.startswith("atlas:"), text.startswith("directions:")
    path = Path(text.removeprefix("atlas:").removeprefix("directions:"))
    suffix = path.suffix.lower()
    if directions or (path.stem == "directions" and suffix in _IMAGE_SUFFIXES and not atlas):
        if suffix not in _IMAGE_SUFFIXES or suffix == ".exr":
            raise InputError(f"output {text!r} has suffix {path.suffix!r}; allowed: .png, .jpg, .jpeg, .webp")
        return Output("directions", path)
    if UDIM in text:
        if suffix not in _IMAGE_SUFFIXES or text.count(UDIM) != 1 or UDIM not in path.name:
            raise InputError(
                f"output {text!r} has {UDIM}; allowed: once, in the name of an image "
                f"({', '.join(_IMAGE_SUFFIXES)})"
            )
        atlas = True
    if "://" in text:
        if not atlas or UDIM not in text:
            raise InputError(f"output {text!r} is a URL; allowed: of tiles, 's3://folder/name.{UDIM}.png'")
        return Output("atlas", Path(path.name), text.removeprefix("atlas:").rpartition("/")[0])
    if suffix in _IMAGE_SUFFIXES:
        return Output("atlas" if atlas else "flat" if flat else "picture", path)
    if displaced and suffix in _DISPLACED_SUFFIXES and not atlas:
        return Output("solid", path)
    if suffix in _MODEL_SUFFIXES and not atlas:
        if suffix == ".usdz":
            check_usd()
        return Output(_MODEL_SUFFIXES[suffix], path)
    allowed = _IMAGE_SUFFIXES if atlas else (*_MODEL_SUFFIXES, *_IMAGE_SUFFIXES)
    raise InputError(f"output {text!r} has suffix {path.suffix!r}; allowed: {', '.join(allowed)}")


@dataclass(frozen=True)
class TexturedModel(Shown):
    """A surface with its texels; mesh and atlas are made when first needed, and shared by all outputs.

    A stream, alone or in a page, holds the quilt and the exemplar instead of the texels: it can be written
    where they are known.

    Attributes
    ----------
    surface, texels
        The surface, and the base colour on it.
    options, threads
        How it is written.
    quilt, exemplar
        What the texels were painted from: an image, or a material.
    maps
        A material's other maps by role, on the same charts, as `upholster.paint_material` makes them. GLB and
        pictures show all but the height; files of their own beside the base colour go with OBJ, PLY, atlas
        and flat texture.
    read_from
        The whole stream that all this was read from, if it was: written again as it is.
    in_tiles
        Whether the texture coordinates of an OBJ are those of UDIM: each page's lie in a square of their own.
    file
        The file that a mesh was read from: a GLB made of it keeps everything else that is in it.
    field
        Which way the sample's rows run on a mesh, where it was just covered.
    notes
        What writing it told: what of that file could not stay as it was.
    name
        Of the material in such a GLB; by default the model's.
    parts
        Of several materials: the model of each, see `upholster.joined`. In such a GLB each is a material of
        its own; all else holds them together.
    density
        Texels for a step of the quilt's charts, each way.
    packed
        Where charts lie in the atlas, if that is known already: as the options say.
    """

    surface: AnySurface
    texels: Texels
    options: WriteOptions = dataclass_field(default_factory=WriteOptions)
    threads: int | None = None
    quilt: Quilt | None = None
    exemplar: PixelArray | Material | None = None
    maps: Mapping[str, Texels] = dataclass_field(default_factory=dict)
    read_from: bytes | None = None
    in_tiles: bool = False
    file: ModelFile | None = None
    field: DirectionField | None = None
    notes: list[str] = dataclass_field(default_factory=list)
    name: str = ""
    parts: tuple["TexturedModel", ...] = ()
    density: float = 1.0
    packed: AtlasLayout | None = None

    def __repr__(self) -> str:
        return on_a_line(
            self, {"surface": self.surface, "texels": self.texels.count, "maps": list(self.maps)}
        )

    @cached_property
    def seams(self) -> tuple[ChartSeam, ...]:
        """How the charts meet along their edges."""
        if isinstance(self.surface, MeshSurface):
            return ()  # charts of a mesh reach beyond it by what gutters need
        return find_seams(self.surface, self.texels.charts)

    @cached_property
    def mesh(self) -> Mesh:
        """The surface as polygons: quadrilaterals, or a mesh's own triangles."""
        if isinstance(self.surface, MeshSurface):
            return charted_mesh(self.surface, self.texels.charts)
        return tessellate(self.surface, self.texels.charts, self.seams, quads=self.options.quads)

    @cached_property
    def atlas(self) -> Atlas:
        """All charts' texels in one image, with gutters, on as many pages as it takes."""
        return build_atlas(self.texels, self.seams, self.layout, threads=self.threads)

    @cached_property
    def layout(self) -> AtlasLayout:
        """Where all charts lie in the atlas."""
        if self.packed is not None:
            return self.packed
        return pack_surface(self.surface, self.texels.charts, **self.options.packing)

    @cached_property
    def stream(self) -> bytes:
        """Quilt and exemplar as a stream; `InputError` where they are not known."""
        return self.read_from if self.read_from is not None else self._coded[0]

    @property
    def sample_quality(self) -> dict[str, float]:
        """The PSNR in dB that `stream` gives each map of the sample, by role; of one that was read, none."""
        return {} if self.read_from is not None else self._coded[1]

    @cached_property
    def _coded(self) -> tuple[bytes, dict[str, float]]:
        if self.quilt is None or self.exemplar is None:
            raise InputError("a stream needs a quilt and its sample, not texels alone")
        parts = source_parts(self.exemplar)
        if missing := self.maps.keys() - parts.keys():
            raise InputError(f"a stream needs the material as sample: it lacks {min(missing)!r}")
        reached: dict[str, float] = {}
        data = encode_stream(
            self.surface,
            self.quilt,
            parts.pop("albedo"),
            maps=parts,
            **self.options.transform,
            most_bytes=self.options.stream_bytes,
            reached=reached,
        )
        return data, reached

    def map_atlas(self, role: str) -> Atlas:
        """Return the atlas of one of `maps`, packed as that of the base colour."""
        texels = self.maps[role]
        if role == "normal" and not isinstance(self.surface, MeshSurface):
            return build_normal_atlas(self.surface, texels, self.seams, self.layout, threads=self.threads)
        return build_atlas(texels, self.seams, self.layout, threads=self.threads)

    @cached_property
    def uv(self) -> FloatArray:
        """Texture coordinates of the mesh's vertices in the whole atlas."""
        return self.atlas.texture_coordinates(self.mesh)

    @cached_property
    def tangents(self) -> FloatArray | None:
        """Tangents of the mesh's vertices; None without a normal map, which alone needs them."""
        if "normal" not in self.maps:
            return None
        if isinstance(self.surface, MeshSurface):
            return charted_tangents(self.mesh)
        return vertex_tangents(self.surface, self.texels.charts, self.mesh)

    @property
    def metres(self) -> float | None:
        """Length of a model unit in metres; None where it is not known."""
        return metres_of(self.surface)

    @cached_property
    def displaced(self) -> DisplacedMesh:
        """The triangles alone, displaced as the options say.

        Raises
        ------
        InputError
            As `check_displacement` and `upholster.model.displaced`.
        """
        options = self.options
        if options.displace is None:
            return plain_solid(self.mesh)
        check_displacement([Output("solid", Path())], options, roles=self.maps, metres=self.metres)
        mesh = self.mesh
        if not isinstance(self.surface, MeshSurface) and len(mesh.quads) > options.triangles // 4:
            # A quadrilateral is two triangles; as many are for the height map at least.
            quads = options.triangles // 4
            mesh = tessellate(self.surface, self.texels.charts, self.seams, quads=quads)
        return displaced(
            mesh,
            self.maps["height"] if options.displace_by == "height" else self.texels,
            amount=parse_length(options.displace, self.metres, name="displace"),
            triangles=options.triangles,
            keep=kept_box(read_conditions(options.keep), self.metres) if options.keep else None,
            mid=options.mid_level,
        )

    @cached_property
    def solid(self) -> Solid:
        """What `displaced` is as a solid: closed or not, its volume, its thinnest wall."""
        found = self.displaced
        return check_solid(found.positions, found.triangles, found.before)

    def solid_notes(self) -> list[str]:
        """Say for people what `displaced` is as a solid."""
        lines, found = solid_lines(self.solid, self.metres), self.displaced
        if found.held:
            held = number_of(found.held, "vertex", "vertices")
            lines.append(f"in narrow corners {held} moved less, so that nothing folds over")
        if found.error:
            lost = shown_length(found.error, self.metres)
            lines.append(f"triangles ran out: the surface is up to {lost} off the height map")
        return lines

    def poster(self) -> bytes:
        """Return a small picture, as WebP: what a page shows before its viewer does."""
        options = replace(self.options, size=_POSTER_SIZE, view=_POSTER_VIEW, quads=_POSTER_QUADS)
        picture = replace(self, options=options).picture()
        return encode_image(from_linear(picture, "uint8"), "webp", quality=_POSTER_QUALITY)

    def picture(self, *, progress: Progress | None = None) -> NDArray[np.float32]:
        """Return a picture of the model, as the options say: (height, width, 3), linear light."""
        own, fitting = self.options.packing, {"gutter": GUTTER, "size": None, "powers": False}
        if own["gutter"] is None and not isinstance(self.surface, MeshSurface):
            own["gutter"] = GUTTER
        if own != fitting:
            # The renderer's mip levels need gutters of 16 texels, and no free room between the charts.
            options = replace(self.options, padding=GUTTER, atlas_size=None, pot=False)
            return replace(self, options=options, packed=None).picture(progress=progress)
        return render(
            self.mesh.positions,
            self.mesh.normals,
            self.uv,
            self.mesh.all_triangles(),
            self.atlas.pixels,
            maps={role: self.map_atlas(role).pixels for role in self.maps if role in SHOWN},
            tangents=self.tangents,
            normal_scale=self.options.normal_scale,
            size=self.options.size,
            view=self.options.view,
            supersample=self.options.supersample,
            threads=self.threads,
            progress=progress,
        )


def textured_model(
    texels: Texels | Mapping[str, Texels],
    *,
    surface: AnySurface | None = None,
    quilt: Quilt | None = None,
    exemplar: PixelArray | Material | None = None,
    options: WriteOptions | None = None,
    threads: int | None = None,
) -> TexturedModel:
    """Put a model together from its texels and what they know of surface, quilt and exemplar.

    Parameters
    ----------
    texels
        As `upholster.paint` makes them, or a material's by role, of `upholster.paint_material`.
    surface, quilt, exemplar
        By default what the texels know.
    options, threads
        How it is written.

    Raises
    ------
    InputError
        If something is missing, or belongs to another surface.
    """
    maps = {"albedo": texels} if isinstance(texels, Texels) else texels
    if not isinstance(maps, Mapping) or not all(isinstance(each, Texels) for each in maps.values()):
        raise InputError(f"texels are {on_a_line(texels)}; allowed: Texels, of `upholster.paint`, or by role")
    if "albedo" not in maps:
        raise InputError(f"texels have no albedo; they have: {', '.join(map(str, maps)) or 'nothing'}")
    base, others = maps["albedo"], {role: each for role, each in maps.items() if role != "albedo"}
    surface = base.surface if surface is None else surface
    if surface is None:
        raise InputError("texels were not painted by `upholster.paint`: their surface is not known")
    base.check_surface(surface)
    for role, each in others.items():
        if each.charts != base.charts:
            raise InputError(f"{role} lies on other charts than albedo; allowed: texels of one quilt")
    if quilt is None:
        quilt = base.quilt
    elif not isinstance(quilt, Quilt):
        raise InputError(f"quilt is a {type(quilt).__name__}; allowed: a Quilt, of `upholster.synthesize`")
    elif [_resized(chart) for chart in quilt.charts] != [_resized(chart) for chart in base.charts]:
        raise InputError(
            "quilt has other charts than the texels; allowed: the quilt that they were painted by"
        )
    if exemplar is None:
        exemplar = _painted_from(maps)
    density = 1.0 if quilt is None else float(np.sqrt(base.count / quilt.steps))
    options = options or WriteOptions()
    return TexturedModel(surface, base, options, threads, quilt, exemplar, others, density=density)


def _resized(chart: Chart) -> Chart:
    """Return what a chart has in common with the same one painted at another density."""
    return replace(chart, height=1, width=1)


def _painted_from(maps: Mapping[str, Texels]) -> PixelArray | Material | None:
    """Return the exemplar that texels know of, of several maps the material."""
    known = {role: texels.exemplar for role, texels in maps.items() if texels.exemplar is not None}
    if len(known) < len(maps):
        return None
    return known["albedo"] if len(known) == 1 else Material(known)


def write_output(
    output: Output, model: TexturedModel, files: Outputs, *, progress: Progress | None = None
) -> None:
    """Write one output to the temporary place that `files` gives it.

    Raises
    ------
    InputError
        If it cannot hold the model, or an option is out of its range.
    """
    options = model.options
    pages = len(model.layout.pages) if output.has_pages else 1
    places = [files.path(file) for file in output.files(model.maps, pages)]
    match output.kind:
        case "uph":
            places[0].write_bytes(model.stream)
        case "html":
            write_html(places[0], model.stream, title=output.path.stem, poster=model.poster())
        case "npz":
            write_npz(places[0], model.texels, maps=model.maps)
        case "atlas":
            for place, image in zip(places[:pages], model.atlas.images(), strict=True):
                write_image(place, image, quality=options.quality)
            _write_maps(places[pages:], model, options.quality)
        case "flat":
            if len(model.texels.arrays) != 1:
                raise InputError(f"a flat texture has one chart; the texels have {len(model.texels.arrays)}")
            write_image(places[0], model.texels.arrays[0], quality=options.quality)
            for role, place in zip(model.maps, places[1:], strict=True):
                write_map(place, role, model.maps[role].arrays[0], quality=options.quality)
        case "glb":
            _write_glb(places[0], model)
        case "usdz":
            _write_usdz(places[0], model)
        case "obj":
            page, uv = model.atlas.page_coordinates(model.mesh)
            if model.in_tiles:
                uv = uv + udim_tile(page) * (1, -1)  # v is downward here, and upward in OBJ
            write_obj(
                places[0],
                places[1],
                places[2 : 2 + pages],
                model.mesh,
                uv,
                model.atlas.images(),
                stem=output.path.stem,
                maps=model.maps,
                page=page,
                **_obj_parts(model),
            )
            _write_maps(places[2 + pages :], model)
        case "ply":
            page, uv = model.atlas.page_coordinates(model.mesh)
            images = model.atlas.images()
            textures = places[1 : 1 + pages]
            write_ply(places[0], textures, model.mesh, uv, images, stem=output.path.stem, page=page)
            _write_maps(places[1 + pages :], model)
        case "solid":
            _write_solid(places[0], output.path, model)
        case "directions":
            if model.field is None:
                raise InputError(
                    f"{output.path} shows the directions of a mesh; allowed: of a model just covered"
                )
            shown = directions_picture(
                model.field, size=options.size, view=options.view, threads=model.threads
            )
            write_image(places[0], shown, quality=options.quality)
        case "picture":
            picture = _whole_picture(model, progress)
            linear = output.path.suffix.lower() == ".exr"
            write_image(
                places[0],
                picture if linear else from_linear(picture, "uint8", dither=True),
                quality=options.quality,
            )


def _whole_picture(model: TexturedModel, progress: Progress | None) -> NDArray[np.float32]:
    """Return a picture of all that a model's file shows: parts that are not covered, and copies, too."""
    file, options = model.file, model.options
    if file is None or file.gltf is None or not (file.left or any(part.instances > 1 for part in file.parts)):
        return model.picture(progress=progress)
    with TemporaryDirectory(prefix="upholster-") as folder:
        glb = Path(folder, "model.glb")
        _write_glb(glb, replace(model, options=replace(options, texture="png"), notes=[]))
        run: dict[str, Any] = {"threads": model.threads, "progress": progress}
        (picture,) = redrawn(glb, [options.view], size=options.size, supersample=options.supersample, **run)
    return picture


def _obj_parts(model: TexturedModel) -> dict[str, Any]:
    """Return how OBJ names the parts of a mesh, as `write_obj` takes them."""
    if not isinstance(model.surface, MeshSurface):
        return {}
    mesh = model.surface.mesh
    materials = [""] * len(mesh.parts) if model.file is None else [each.material for each in model.file.parts]
    labels = [ObjPart(name, own) for name, own in zip(mesh.parts, materials, strict=True)]
    return {"parts": labels, "part": mesh.part}


def _write_glb(place: Path, model: TexturedModel) -> None:
    if model.file is not None and model.file.gltf is not None:
        _write_retextured(place, model)
        return
    page, uv = model.atlas.page_coordinates(model.mesh)
    write_glb(
        place,
        model.mesh,
        uv,
        model.atlas.images(),
        texture=model.options.texture,
        quality=model.options.quality,
        # glTF has no place for the height.
        maps={role: model.map_atlas(role).images() for role in model.maps if role != "height"},
        page=page,
        tangents=model.tangents,
        normal_scale=model.options.normal_scale,
        name=model.surface.name or "surface",
    )


def _write_usdz(place: Path, model: TexturedModel) -> None:
    """Write what the GLB shows, with textures that USDZ may hold."""
    own = replace(model.options, texture="png" if model.options.texture == "webp" else model.options.texture)
    with TemporaryDirectory(prefix="upholster-") as folder:
        glb = Path(folder, "model.glb")
        _write_glb(glb, model if own == model.options else replace(model, options=own))
        is_gltf = model.file is not None and model.file.gltf is not None
        notes = write_usdz(place, glb.read_bytes(), metres=1.0 if is_gltf else model.metres or 1.0)
    model.notes.extend(note for note in notes if note not in model.notes)


def _write_retextured(place: Path, model: TexturedModel) -> None:
    """Write the file that a mesh was read from, with its new textures and all else that it holds."""
    assert model.file is not None  # the caller looked
    options = model.options
    notes = write_retextured_glb(
        place,
        model.file,
        [_cover(part) for part in model.parts or (model,)],
        texture=options.texture,
        quality=options.quality,
        normal_scale=options.normal_scale,
    )
    model.notes.extend(note for note in notes if note not in model.notes)


def _cover(model: TexturedModel) -> Cover:
    """Return a model's texture on the triangles that it covers."""
    assert isinstance(model.surface, MeshSurface)  # what is read from a model's file
    page, uv = model.atlas.page_coordinates(model.mesh)
    covered = np.flatnonzero(model.surface.island >= 0)
    corners = model.mesh.triangles[covered]
    return Cover(
        uv[corners],
        model.atlas.images(),
        covered,
        page[corners[:, 0]],
        {role: model.map_atlas(role).images() for role in model.maps if role != "height"},
        model.name,
    )


def _write_solid(place: Path, target: Path, model: TexturedModel) -> None:
    """Write a model's triangles alone. STL and 3MF are in millimetres where the model's unit is known."""
    found, name = model.displaced, model.surface.name or target.stem
    match target.suffix.lower():
        case ".obj":
            write_bare_obj(place, found.positions, found.triangles, name=name)
        case ".ply":
            write_bare_ply(place, found.positions, found.triangles)
        case suffix:
            millimetres = found.positions * (1.0 if model.metres is None else 1000.0 * model.metres)
            if suffix == ".stl":
                write_stl(place, millimetres, found.triangles)
            else:
                write_3mf(place, millimetres, found.triangles, name=name)


def _write_maps(places: Sequence[Path], model: TexturedModel, quality: int = 90) -> None:
    """Write every page of the atlases of a material's other maps, one map after the other."""
    remaining = iter(places)
    for role in model.maps:
        for image in model.map_atlas(role).images():
            write_map(next(remaining), role, image, quality=quality)
