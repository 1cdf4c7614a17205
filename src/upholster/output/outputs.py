"""Outputs by name, their checks before work, and their writers, one for each kind."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from upholster.base.errors import InputError
from upholster.base.files import Outputs, write_bytes
from upholster.base.formats import OUTPUTS, UDIM, OutputKind, kind_of, split_name, suffixes_of
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import FloatArray, IntArray, PixelArray
from upholster.charts.layout import LONGEST
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.color import alpha_channel, from_linear
from upholster.image.files.write import write_image
from upholster.image.roles import MAP_ROLES
from upholster.model.packing import GUTTER
from upholster.model.render.directions import directions_picture
from upholster.model.textured_model import TexturedModel
from upholster.output.export.bare import write_bare_obj, write_bare_ply
from upholster.output.export.glb import write_glb
from upholster.output.export.glb_copy import Cover, write_retextured_glb
from upholster.output.export.html import write_html
from upholster.output.export.map_files import map_companion, write_map
from upholster.output.export.npz import write_npz
from upholster.output.export.obj import ObjPart, write_obj, write_tiled_obj
from upholster.output.export.pages import PagedMesh, page_files
from upholster.output.export.ply import write_ply
from upholster.output.export.stl import write_stl
from upholster.output.export.three_mf import write_3mf
from upholster.output.export.usdz import check_usd, write_usdz
from upholster.output.glb_picture import redrawn
from upholster.runtime.parallel import quietly

__all__ = ["Output", "largest_chart", "parse_output", "parse_outputs", "write_output"]

_TILE_LIMIT = 4096
"""Texels of the largest chart on tiles, gutters included, if no size is requested."""


@dataclass(frozen=True, slots=True)
class Output:
    """One output: its kind and its place.

    Attributes
    ----------
    kind
        One of `upholster.base.formats.OUTPUTS`.
    path
        The file; some kinds have further files next to it.
    url
        URL of its folder; empty: `path` is a local path.
    lod
        For a GLB: number of times its textures are halved each way.
    tiles
        For an OBJ: the output of UDIM tiles that its material refers to. None: it has textures of its own.
    """

    kind: OutputKind
    path: Path
    url: str = ""
    lod: int = 0
    tiles: "Output | None" = None

    @property
    def in_tiles(self) -> bool:
        """Whether its pages are tiles of UDIM."""
        return UDIM in self.path.name

    @property
    def own(self) -> tuple[Path, ...]:
        """Its files other than textures."""
        if self.kind.texture == "":
            return ()
        return self.path, *(self.path.with_name(self.path.stem + ending) for ending in self.kind.beside)

    def files(self, roles: Iterable[str] = (), pages: int = 1) -> tuple[Path, ...]:
        """Return all of its files: textures after the model, the base colour's first.

        Parameters
        ----------
        roles
            Roles of a material's maps other than the base colour, see `TexturedModel.maps`.
        pages
            Number of pages of the atlas.
        """
        if self.url:
            return ()  # no file on this machine
        ending = self.kind.texture
        if ending is None or self.tiles is not None:
            return self.own
        texture = self.path.with_name(self.path.stem + ending) if ending else self.path
        textures = [texture, *(map_companion(texture, role) for role in roles)]
        pages = pages if self.kind.pages else 1
        return *self.own, *(file for path in textures for file in page_files(path, pages))

    def tile_names(self, roles: Iterable[str]) -> dict[str, str]:
        """Return an OBJ's names for the tiles of each map, by role, the base colour's first.

        `roles` are as for `files`.
        """
        assert self.tiles is not None  # the caller has checked it
        path = self.tiles.path
        where = self.tiles.url or Path(os.path.relpath(path.parent, self.path.parent)).as_posix()
        prefix = "" if where == "." else f"{where}/"
        own = {role: map_companion(path, role) for role in roles}
        return {role: prefix + file.name for role, file in {"albedo": path, **own}.items()}


def largest_chart(outputs: Iterable[Output], options: WriteOptions) -> int:
    """Return the greatest side of charts in texels: on tiles and pages of a given size each must fit one."""
    if options.atlas_size is None and not any(output.in_tiles for output in outputs):
        return LONGEST
    padding = GUTTER if options.padding is None else options.padding
    step = 1 << max(0, padding.bit_length() - 1)
    size = _TILE_LIMIT if options.atlas_size is None else options.atlas_size
    return max(1, min(LONGEST, size // step * step - 2 * padding))


def parse_outputs(
    targets: Iterable[str | os.PathLike[str]], options: WriteOptions, *, flat: bool = False
) -> list[Output]:
    """Read outputs as `parse_output` does; a GLB is followed by its further files, see `WriteOptions.lods`.

    If there are UDIM tiles, an OBJ refers to the first ones.

    Raises
    ------
    InputError
        As for `parse_output`; and if an option is chosen that none of the outputs uses.
    """
    outputs = [parse_output(target, flat=flat, displaced=options.displace is not None) for target in targets]
    if options.lods > 1:
        _check_used("lods", outputs, [kind for kind in OUTPUTS if kind.lods])
    if options.displace is not None:
        _check_used("displace", outputs, [kind for kind in OUTPUTS if kind.solid])
    if options.stream_choices:
        streams = [kind for kind in OUTPUTS if kind.stream]
        _check_used(options.stream_choices[0], outputs, streams)
    tiles = next((output for output in outputs if output.in_tiles), None)
    outputs = [replace(each, tiles=tiles) if each.kind.name == "obj" else each for each in outputs]
    return [
        replace(output, path=output.path.with_stem(output.path.stem + f"_lod{k}" * (k > 0)), lod=k)
        for output in outputs
        for k in range(options.lods if output.kind.lods else 1)
    ]


def _check_used(option: str, outputs: Sequence[Output], kinds: Sequence[OutputKind]) -> None:
    if not any(output.kind in kinds for output in outputs):
        *others, last = suffixes_of(kinds)
        allowed = f"{', '.join(others)} and {last}" if others else last
        names = ", ".join(str(output.path) for output in outputs)
        raise InputError(f"{option} is for {allowed}, and {names} is none; allowed: with one")


def parse_output(target: str | os.PathLike[str], *, flat: bool = False, displaced: bool = False) -> Output:
    """Read an output as on the command line: a path, or ``atlas:`` or ``directions:`` and a path.

    An image with ``<UDIM>`` in its name is an atlas, too: in tiles, each a file with its number there. An
    output with the prefix ``directions`` shows the direction field of a mesh.

    Parameters
    ----------
    target
        The user's text.
    flat
        Whether images are a flat texture's texels, and not pictures of a model.
    displaced
        Whether OBJ and PLY are only triangles, displaced.

    Raises
    ------
    InputError
        For an unknown suffix, ``<UDIM>`` where there can be no tiles, or a missing package.
    """
    if not isinstance(target, (str, os.PathLike)):
        raise InputError(f"output is a {type(target).__name__}; allowed: a path, as text or pathlib.Path")
    if not isinstance(flat, bool):
        raise InputError(f"flat is a {type(flat).__name__}; allowed: True or False")
    text = os.fspath(target)
    prefix, place = split_name(text)
    only = [name for name, holds in (("flat", flat), ("displaced", displaced)) if holds]
    kind, path = kind_of(prefix, place, only), Path(place)
    in_tiles = text.count(UDIM) == 1 and UDIM in path.name and kind is not None and kind.tiles
    if UDIM in text and not in_tiles:
        allowed = ", ".join(suffixes_of(kind for kind in OUTPUTS if kind.tiles))
        raise InputError(f"output {text!r} has {UDIM}; allowed: once, in the name of an image ({allowed})")
    if not in_tiles and UDIM.lower() in text.lower():
        raise InputError(f"output {text!r} spells {UDIM} otherwise; allowed: {UDIM}, in capital letters")
    if "://" in text and not in_tiles:
        raise InputError(f"output {text!r} is a URL; allowed: URLs of tiles, 's3://folder/name.{UDIM}.png'")
    if kind is None:
        allowed = ", ".join(suffixes_of(kind for kind in OUTPUTS if kind.prefix == prefix))
        raise InputError(f"output {text!r} has suffix {path.suffix!r}; allowed: {allowed}")
    if kind.extra:
        _EXTRAS[kind.extra]()
    if "://" in text:
        return Output(kind, Path(path.name), place.rpartition("/")[0])
    return Output(kind, path)


def write_output(output: Output, model: TexturedModel, files: Outputs) -> tuple[Path, ...]:
    """Write one output to the temporary places that `files` gives it; return its files.

    Raises
    ------
    InputError
        If it cannot hold the model, or an option is out of range.
    """
    pages = len(model.layout.pages) if output.kind.pages else 1
    targets = output.files(model.maps, pages)
    places, own = [files.path(target) for target in targets], len(output.own)
    named = None if output.tiles is None else output.tile_names(model.maps)
    to = _Places(output.path, places[:own], places[own : own + pages], places[own + pages :], named)
    _WRITERS[output.kind.name](model, to)
    return targets


_EXTRAS: dict[str, Callable[[], None]] = {"usd": check_usd}
"""Checks that an extra is installed."""


class _Places(NamedTuple):
    """The places of an output: its path, and the temporary paths of its files, pages and maps.

    `tiles` has the names of the tiles that it refers to instead, by role; None: it has pages of its own.
    """

    path: Path
    own: Sequence[Path]
    pages: Sequence[Path]
    maps: Sequence[Path]
    tiles: Mapping[str, str] | None


def _write_atlas(model: TexturedModel, to: _Places) -> None:
    for place, image in zip(to.pages, model.atlas.images(), strict=True):
        write_image(place, image, quality=model.options.quality)
    _write_maps(model, to, model.options.quality)


def _write_flat(model: TexturedModel, to: _Places) -> None:
    if len(model.texels.arrays) != 1:
        raise InputError(f"a flat texture has one chart; the texels have {len(model.texels.arrays)}")
    write_image(to.pages[0], model.texels.arrays[0], quality=model.options.quality)
    for role, place in zip(model.maps, to.maps, strict=True):
        write_map(place, role, model.maps[role].arrays[0], quality=model.options.quality)


def _paged(model: TexturedModel) -> PagedMesh:
    page, uv = model.atlas.page_coordinates(model.atlas_mesh)
    return PagedMesh(model.atlas_mesh, uv, model.atlas.images(), page, model.metres)


def _write_obj(model: TexturedModel, to: _Places) -> None:
    how: dict[str, Any] = {"stem": to.path.stem}
    if isinstance(model.atlas_surface, MeshSurface):
        mesh, file = model.atlas_surface.mesh, model.file
        materials = [""] * len(mesh.parts) if file is None else [each.material for each in file.parts]
        labels = [ObjPart(*each) for each in zip(mesh.parts, materials, strict=True)]
        how |= {"parts": labels, "part": mesh.part}
    if to.tiles is not None:
        how["alpha"] = alpha_channel(model.texels.arrays[0].shape[2]) is not None
        write_tiled_obj(to.own[0], to.own[1], _paged(model), to.tiles, **how)
        return
    write_obj(to.own[0], to.own[1], to.pages, _paged(model), maps=model.maps, **how)
    _write_maps(model, to)


def _write_ply(model: TexturedModel, to: _Places) -> None:
    write_ply(to.own[0], to.pages, _paged(model), stem=to.path.stem)
    _write_maps(model, to)


def _write_directions(model: TexturedModel, to: _Places) -> None:
    options = model.options
    if model.field is None:
        raise InputError(f"{to.path} shows the directions of a mesh; allowed: for a model just covered")
    with quietly():
        shown = directions_picture(model.field, size=options.size, view=options.view)
    write_image(to.own[0], shown, quality=options.quality)


def _write_picture(model: TexturedModel, to: _Places) -> None:
    """Write a picture of everything in a model's file, including uncovered parts and copies."""
    file, options = model.file, model.options
    if file is None or file.gltf is None or not (file.left or any(part.instances > 1 for part in file.parts)):
        picture = model.picture()
    else:
        with TemporaryDirectory(prefix="upholster-") as folder:
            glb = Path(folder, "model.glb")
            _write_glb(glb, replace(model, options=replace(options, texture="png"), notes=[]))
            notes: list[str] = []
            (picture,) = redrawn(
                glb, [options.view], size=options.size, supersample=options.supersample, notes=notes
            )
            _note(model, notes)
    linear = to.path.suffix.lower() == ".exr"
    pixels = picture if linear else from_linear(picture, "uint8", dither=True)
    write_image(to.own[0], pixels, quality=options.quality)


def _write_glb(place: Path, model: TexturedModel) -> None:
    """Write a GLB: for a mesh from a glTF file that file, with new textures and everything else in it."""
    options = model.options
    how: dict[str, Any] = {"texture": options.texture, "quality": options.quality}
    how["normal_scale"] = options.normal_scale
    if model.file is not None and model.file.gltf is not None:
        covers = [_cover(_with_whole_triangles(part, model)) for part in model.parts or (model,)]
        _note(model, write_retextured_glb(place, model.file, covers, **how))
        return
    write_glb(
        place,
        _paged(model),
        maps=_gltf_maps(model),
        tangents=model.tangents,
        name=model.surface.name or "surface",
        **how,
    )


def _gltf_maps(model: TexturedModel) -> dict[str, Sequence[PixelArray]]:
    """Return the pages of the maps that glTF can store."""
    left_out = [role.name for role in MAP_ROLES.values() if not role.gltf]
    return {role: model.map_atlas(role).images() for role in model.maps if role not in left_out}


def _note(model: TexturedModel, notes: Iterable[str]) -> None:
    model.notes.extend(note for note in notes if note not in model.notes)


def _write_usdz(model: TexturedModel, to: _Places) -> None:
    """Write the content of the GLB, with textures in formats that USDZ allows."""
    own = replace(model.options, texture="png" if model.options.texture == "webp" else model.options.texture)
    with TemporaryDirectory(prefix="upholster-") as folder:
        glb = Path(folder, "model.glb")
        _write_glb(glb, model if own == model.options else replace(model, options=own))
        _note(model, write_usdz(to.own[0], glb.read_bytes()))


def _with_whole_triangles(part: TexturedModel, model: TexturedModel) -> TexturedModel:
    """Return a model whose atlas cuts no triangles: those of a glTF file stay as they are.

    `part` is the model, or the part of it with one material.
    """
    cuts = part.layout.cuts
    if cuts is None or not cuts.halved:
        return part
    _note(
        model,
        [
            f"a triangle is larger than a page of {part.options.atlas_size} texels and stays whole in glTF: "
            "pages there are as large as their charts need"
        ],
    )
    return replace(part, options=replace(part.options, atlas_size=None), packed=None)


def _cover(model: TexturedModel) -> Cover:
    """Return a model's texture on the triangles that it covers."""
    surface, mesh = model.atlas_surface, model.atlas_mesh
    assert isinstance(surface, MeshSurface)  # models are read from files as meshes
    page, uv = model.atlas.page_coordinates(mesh)
    covered = np.flatnonzero(surface.island >= 0)
    corners = mesh.triangles[covered]
    return Cover(
        uv[corners],
        model.atlas.images(),
        covered,
        page[corners[:, 0]],
        _gltf_maps(model),
        model.name,
    )


def _solid(model: TexturedModel, *, millimetres: bool) -> tuple[FloatArray, IntArray]:
    """Return vertices and triangles of a solid: in millimetres, if wanted and the unit is known."""
    scale = 1000.0 * model.metres if millimetres and model.metres is not None else 1.0
    return model.displaced.positions * scale, model.displaced.triangles


def _write_maps(model: TexturedModel, to: _Places, quality: int = 90) -> None:
    """Write every page of the atlases of a material's other maps, one map after the other."""
    remaining = iter(to.maps)
    for role in model.maps:
        for image in model.map_atlas(role).images():
            write_map(next(remaining), role, image, quality=quality)


_WRITERS: dict[str, Callable[[TexturedModel, _Places], object]] = {
    "glb": lambda model, to: _write_glb(to.own[0], model),
    "usdz": _write_usdz,
    "obj": _write_obj,
    "ply": _write_ply,
    "npz": lambda model, to: write_npz(to.own[0], model.texels, maps=model.maps),
    "stream": lambda model, to: write_bytes(to.own[0], model.stream),
    "page": lambda model, to: write_html(to.own[0], model.stream, title=to.path.stem, poster=model.poster()),
    "stl": lambda model, to: write_stl(to.own[0], *_solid(model, millimetres=True)),
    "3mf": lambda model, to: write_3mf(
        to.own[0], *_solid(model, millimetres=True), name=model.surface.name or to.path.stem
    ),
    "solid obj": lambda model, to: write_bare_obj(
        to.own[0], *_solid(model, millimetres=False), name=model.surface.name or to.path.stem
    ),
    "solid ply": lambda model, to: write_bare_ply(to.own[0], *_solid(model, millimetres=False)),
    "picture": _write_picture,
    "flat": _write_flat,
    "atlas": _write_atlas,
    "directions": _write_directions,
}
"""Writers by the names of `upholster.base.formats.OUTPUTS`."""
