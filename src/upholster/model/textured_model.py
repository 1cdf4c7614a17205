"""The textured model: a surface with its texels, and everything that is made of them and written."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upholster.base.conditions import read_conditions
from upholster.base.display import Shown, number_of, on_a_line
from upholster.base.errors import InputError
from upholster.base.lengths import parse_length
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.chart_seams import ChartSeam, find_seams
from upholster.charts.directions.field import DirectionField
from upholster.charts.tessellation.mesh import Mesh, tessellate
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.model_files.model_file import ModelFile
from upholster.image.color import from_linear
from upholster.image.files.material import Material
from upholster.image.files.source import source_parts
from upholster.image.files.write import encode_image
from upholster.model.atlas import Atlas, build_atlas
from upholster.model.displaced_mesh import DisplacedMesh, displaced, kept_box, plain_solid
from upholster.model.islands import pack_atlas
from upholster.model.mesh_on_charts import charted_tangents, mesh_on_charts
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.packing import GUTTER, AtlasLayout
from upholster.model.render.material_maps import SHOWN
from upholster.model.render.picture import render
from upholster.model.solid import Solid, check_solid, shown_length, solid_lines
from upholster.model.tangents import vertex_tangents
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt, Texels
from upholster.runtime.parallel import quietly

__all__ = ["TexturedModel", "check_displacement", "metres_of", "textured_model"]

_POSTER_SIZE, _POSTER_VIEW, _POSTER_QUADS, _POSTER_QUALITY = (320, 240), (30.0, 30.0), 4000, 20
"""View of a page's poster: the viewer's first view."""


def metres_of(surface: AnySurface) -> float | None:
    """Return the length of a model unit in metres; None if it is not known."""
    return surface.mesh.metres if isinstance(surface, MeshSurface) else None


def check_displacement(options: WriteOptions, *, roles: Iterable[str], metres: float | None) -> None:
    """Raise InputError, before any work, if a model can not be displaced as the options say.

    `roles` are those of the sample's maps, `metres` is the length of a model unit; None if it is not known.
    """
    if options.displace is None:
        return
    if options.displace_by == "height" and "height" not in roles:
        raise InputError(
            "displace needs a height map, and the sample has none; allowed: a material with one, or "
            "displace_by 'luminance'"
        )
    parse_length(options.displace, metres, name="displace")
    kept_box(read_conditions(options.keep) if options.keep else (), metres)


@dataclass(frozen=True)
class TexturedModel(Shown):
    """A surface with its texels; mesh and atlas are made when first needed, and shared by all outputs.

    A stream, by itself or in a page, holds the quilt and the exemplar instead of the texels: it can be
    written if they are known.

    Attributes
    ----------
    surface, texels
        The surface, and the base colour on it.
    options
        How it is written.
    quilt, exemplar
        The quilt, and the image or material, that the texels were painted from.
    maps
        A material's other maps by role, on the same charts, as `upholster.paint_material` makes them. GLB and
        pictures show all but the height; OBJ, PLY, atlas and flat texture store them in files of their own,
        next to the base colour's.
    read_from
        The complete stream that everything was read from, if any: it is written unchanged.
    file
        The file that a mesh was read from: a GLB made from it keeps everything else in that file.
    field
        Direction of the sample's rows on a mesh, if it was just covered.
    notes
        Warnings from writing: parts of the original file that could not be kept.
    name
        Name of the material in such a GLB; by default the model's.
    parts
        With several materials: the model of each, see `upholster.model.composite`. In such a GLB each is a
        material of its own; all other outputs hold them together.
    density
        Texels per step of the quilt's charts, each way.
    packed
        The places of charts in the atlas, if they are known already: as the options say.
    """

    surface: AnySurface
    texels: Texels
    options: WriteOptions = dataclass_field(default_factory=WriteOptions)
    quilt: Quilt | None = None
    exemplar: PixelArray | Material | None = None
    maps: Mapping[str, Texels] = dataclass_field(default_factory=dict)
    read_from: bytes | None = None
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
        """The seams of charts along their edges."""
        if isinstance(self.surface, MeshSurface):
            return ()  # charts of a mesh extend beyond it by the width of gutters
        return find_seams(self.surface, self.texels.charts)

    @cached_property
    def mesh(self) -> Mesh:
        """The surface as quadrilaterals, or as a mesh's own triangles."""
        if isinstance(self.surface, MeshSurface):
            return mesh_on_charts(self.surface, self.texels.charts)
        return tessellate(self.surface, self.texels.charts, self.seams, quads=self.options.quads)

    @cached_property
    def atlas_mesh(self) -> Mesh:
        """The mesh with places in the atlas: `mesh`, unless islands are cut there."""
        cuts = self.layout.cuts
        return self.mesh if cuts is None else mesh_on_charts(cuts.surface, cuts.charts)

    @property
    def atlas_surface(self) -> AnySurface:
        """The surface of `atlas_mesh`."""
        return self.surface if self.layout.cuts is None else self.layout.cuts.surface

    @cached_property
    def atlas(self) -> Atlas:
        """All charts' texels in one image, with gutters, on as many pages as needed."""
        return self._atlas_of(self.texels)

    def _atlas_of(self, texels: Texels) -> Atlas:
        cuts = self.layout.cuts
        shown = texels if cuts is None else cuts.texels(texels)
        return build_atlas(shown, self.seams, self.layout)

    @cached_property
    def layout(self) -> AtlasLayout:
        """The places of all charts in the atlas."""
        if self.packed is not None:
            return self.packed
        return pack_atlas(self.surface, self.texels.charts, **self.options.packing)

    @cached_property
    def stream(self) -> bytes:
        """Quilt and exemplar as a stream; `InputError` if they are not known."""
        return self.read_from if self.read_from is not None else self._coded[0]

    @property
    def sample_quality(self) -> dict[str, float]:
        """The PSNR in dB of each map of the sample in `stream`, by role; empty for a stream that was read."""
        return {} if self.read_from is not None else self._coded[1]

    @cached_property
    def _coded(self) -> tuple[bytes, dict[str, float]]:
        if self.quilt is None or self.exemplar is None:
            raise InputError("a stream needs a quilt and its sample, not only texels")
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
        """Return the atlas of one of `maps`, packed like that of the base colour."""
        texels = self.maps[role]
        if role == "normal" and not isinstance(self.surface, MeshSurface):
            return build_normal_atlas(self.surface, texels, self.seams, self.layout)
        return self._atlas_of(texels)

    @cached_property
    def uv(self) -> FloatArray:
        """Texture coordinates of the vertices of `atlas_mesh` in the complete atlas."""
        return self.atlas.texture_coordinates(self.atlas_mesh)

    @cached_property
    def tangents(self) -> FloatArray | None:
        """Tangents of the vertices of `atlas_mesh`; None without a normal map, the only user of them."""
        if "normal" not in self.maps:
            return None
        if isinstance(self.surface, MeshSurface):
            return charted_tangents(self.atlas_mesh)
        return vertex_tangents(self.surface, self.texels.charts, self.mesh)

    @property
    def metres(self) -> float | None:
        """Length of a model unit in metres; None if it is not known."""
        return metres_of(self.surface)

    @cached_property
    def displaced(self) -> DisplacedMesh:
        """The triangles, displaced as the options say, without a texture.

        Raises
        ------
        InputError
            As for `check_displacement` and `upholster.model.displaced_mesh`.
        """
        options = self.options
        if options.displace is None:
            return plain_solid(self.mesh)
        check_displacement(options, roles=self.maps, metres=self.metres)
        mesh = self.mesh
        if not isinstance(self.surface, MeshSurface) and len(mesh.quads) > options.triangles // 4:
            # A quadrilateral is two triangles; at least this many are for the height map.
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
        """Whether `displaced` is a closed solid, its volume and its thinnest wall."""
        found = self.displaced
        return check_solid(found.positions, found.triangles, found.before)

    def solid_notes(self) -> list[str]:
        """Return the properties of `displaced` as a solid, in words."""
        lines, found = solid_lines(self.solid, self.metres), self.displaced
        if found.held:
            held = number_of(found.held, "vertex", "vertices")
            lines.append(f"in narrow corners {held} moved less, so that nothing folds over")
        if found.error:
            lost = shown_length(found.error, self.metres)
            lines.append(f"triangles ran out: the surface is up to {lost} off the height map")
        return lines

    def poster(self) -> bytes:
        """Return a small picture, as WebP: a page shows it before its viewer has loaded."""
        options = replace(self.options, size=_POSTER_SIZE, view=_POSTER_VIEW, quads=_POSTER_QUADS)
        with quietly():
            picture = replace(self, options=options).picture()
        return encode_image(from_linear(picture, "uint8"), "webp", quality=_POSTER_QUALITY)

    def picture(self) -> NDArray[np.float32]:
        """Return a picture of the model, as the options say: (height, width, 3), linear light."""
        own, fitting = self.options.packing, {"gutter": GUTTER, "size": None, "powers": False}
        if own["gutter"] is None and not isinstance(self.surface, MeshSurface):
            own["gutter"] = GUTTER
        if own != fitting:
            # The renderer's mip levels need gutters of 16 texels, and no free room between the charts.
            options = replace(self.options, padding=GUTTER, atlas_size=None, pot=False)
            return replace(self, options=options, packed=None).picture()
        return render(
            self.atlas_mesh.positions,
            self.atlas_mesh.normals,
            self.uv,
            self.atlas_mesh.all_triangles(),
            self.atlas.pixels,
            maps={role: self.map_atlas(role).pixels for role in self.maps if role in SHOWN},
            tangents=self.tangents,
            normal_scale=self.options.normal_scale,
            size=self.options.size,
            view=self.options.view,
            supersample=self.options.supersample,
        )


def textured_model(
    texels: Texels | Mapping[str, Texels],
    *,
    surface: AnySurface | None = None,
    quilt: Quilt | None = None,
    exemplar: PixelArray | Material | None = None,
    options: WriteOptions | None = None,
) -> TexturedModel:
    """Build a model from its texels and the surface, quilt and exemplar that they refer to.

    Parameters
    ----------
    texels
        As from `upholster.paint`, or a material's by role, from `upholster.paint_material`.
    surface, quilt, exemplar
        By default those that the texels refer to.
    options
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
            "quilt has other charts than the texels; allowed: the quilt from which they were painted"
        )
    if exemplar is None:
        exemplar = _painted_from(maps)
    density = 1.0 if quilt is None else float(np.sqrt(base.count / quilt.steps))
    options = options or WriteOptions()
    return TexturedModel(surface, base, options, quilt, exemplar, others, density=density)


def _resized(chart: Chart) -> Chart:
    """Return a chart's properties that do not depend on the density of painting."""
    return replace(chart, height=1, width=1)


def _painted_from(maps: Mapping[str, Texels]) -> PixelArray | Material | None:
    """Return the exemplar that texels refer to; for several maps the material."""
    known = {role: texels.exemplar for role, texels in maps.items() if texels.exemplar is not None}
    if len(known) < len(maps):
        return None
    return known["albedo"] if len(known) == 1 else Material(known)
