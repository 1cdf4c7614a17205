"""Set up a synthesis: layout, scale and direction on patches, on a mesh, or of a flat texture."""

from typing import cast

import numpy as np

from upholster.base.errors import InputError
from upholster.base.lengths import parse_length
from upholster.base.options.choices import method_options
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import FloatArray, PixelArray
from upholster.charts.charted_surface import ChartedSurface, charted_mesh, charted_patches, charted_plane
from upholster.charts.creases import default_crease
from upholster.charts.directions.detail import in_detail
from upholster.charts.directions.direction import Direction, parse_direction
from upholster.charts.directions.direction_image import is_direction_image
from upholster.charts.directions.field import default_direction, direction_field
from upholster.charts.directions.patch_directions import default_on_patches, vectors_on_patches
from upholster.charts.directions.strokes import is_stroke_file
from upholster.charts.layout import LONGEST, TextureScale, density_layout, texture_scale, uniform_layout
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.phases.course_phases import CourseField, course_field
from upholster.charts.phases.phase_cells import PhaseField, phase_field
from upholster.charts.size_map import SizeField, parse_size_map, size_field
from upholster.charts.turns import chart_turns
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.patches.surface import Surface
from upholster.image.elements.courses import find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import find_lattice
from upholster.quilt.chart import MAX_CHART, Chart
from upholster.quilt.warp_field import WarpField
from upholster.runtime.stages import file_stage
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.guidance import steering_on
from upholster.synthesis.guidance_reader import guidance_files
from upholster.synthesis.paper.method import PaperOptions
from upholster.synthesis.patch_scene import PatchScene
from upholster.synthesis.pixel.method import PixelOptions, check_sample
from upholster.synthesis.quilt.method import step_level
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.quilt.sizes import LEAST_SIDE, block_side, suiting_side
from upholster.synthesis.quilt.usable_blocks import check_level, check_used, largest_block, usable_side

__all__ = ["prepare", "request_files", "sample_width"]

_MOST_OCTAVES = 6
"""Texels per step are at most 2^6 each way, as in `Quilt.density`."""


def request_files(options: SynthesisOptions) -> list[str]:
    """Return the files that options name: of strokes, of images of directions and sizes, of guides.

    Raises
    ------
    InputError
        If a text that names a file is malformed.
    """
    images = [options.direction.strip()] if is_direction_image(options.direction) else []
    sizes = () if options.size_map is None else parse_size_map(options.size_map).map.files
    strokes = [text.strip() for text in options.stroke or () if is_stroke_file(text)]
    return [*strokes, *images, *sizes, *guidance_files(options)]


def _inputs(
    _made: object, _exemplar: Exemplar, _surface: AnySurface, options: SynthesisOptions, **_more: object
) -> list[str]:
    return request_files(options)


@file_stage(_inputs)
def prepare(
    exemplar: Exemplar,
    surface: AnySurface,
    options: SynthesisOptions,
    *,
    largest: int = LONGEST,
    model: ModelFile | None = None,
) -> Scene | PatchScene:
    """Return the scene that a method covers; `options` are as for `synthesize`.

    On patches no chart of method "quilt" is longer than `largest` texels. `model` is the file that a mesh was
    read from.

    Raises
    ------
    InputError
        If something is out of range on this surface, or with this exemplar.
    """
    check_used(exemplar.used, options.method)
    if isinstance(surface, MeshSurface):
        return _prepare_mesh(exemplar, surface, options, model)
    if options.method != "quilt":
        if options.method == "pixel":
            check_sample(exemplar.shape, options.levels)
        kind: type[PaperOptions | PixelOptions] = PaperOptions if options.method == "paper" else PixelOptions
        return PatchScene(uniform_layout(surface, chart=options.chart), method_options(options, kind))
    if isinstance(options.texels, tuple):
        return _prepare_flat(exemplar, surface, _flat_chart(surface, *options.texels), options)
    scale = _scale(exemplar, surface, options, None)
    texels_a_step = _texels_a_step(scale)
    steps = scale.density / texels_a_step
    charts = density_layout(surface, density=steps, largest=max(1, int(largest / texels_a_step)))
    charted = charted_patches(surface, charts)
    asked = options.direction
    if asked is None:
        asked = "smooth" if options.stroke else default_on_patches(surface, charted)
    wanted = parse_direction(cast(str, asked), patches=True)
    ground = MapGround(charted, None, surface, False)
    return _on_charts(exemplar, ground, options, scale, texels_a_step, wanted)


def _prepare_flat(exemplar: Exemplar, surface: AnySurface, chart: Chart, options: SynthesisOptions) -> Scene:
    # A flat texture: a step is a pixel, and the sample's rows run along rows.
    if options.size_map is not None:
        raise InputError("size_map is given for a flat texture; allowed: on surfaces and models")
    for name in ("crease", "stroke"):
        if getattr(options, name) is not None:
            raise InputError(f"{name} is given for a flat texture; allowed: none, its rows run to the right")
    charted = charted_plane(chart, tile=options.tileable)
    vectors = np.broadcast_to((1.0, 0.0, 0.0), (len(charted.chart), 3, 3))
    ground = MapGround(charted, None, surface, True)
    phases = _phases(exemplar, options, charted, vectors, 1.0, None)
    block = _wanted_block(exemplar, options)
    return Scene(
        charted,
        vectors,
        (WarpField.identity(),),
        _own_options(options, block),
        np.zeros(len(vectors), np.int32),
        phases=phases,
        steering=steering_on(ground, exemplar.guidance, block),
    )


def _own_options(options: SynthesisOptions, block: int) -> QuiltOptions:
    # A scene has directions as vectors; they may be functions, which tasks can not pickle.
    return method_options(options, QuiltOptions, block=block, direction=None, stroke=None)


def _flat_chart(surface: Surface, width: int, height: int) -> Chart:
    if len(surface.patches) != 1:
        raise InputError(
            f"texels is {width}x{height} on {len(surface.patches)} patches; allowed there: a number"
        )
    if not (8 <= width <= MAX_CHART and 8 <= height <= MAX_CHART):
        raise InputError(f"texels is {width}x{height}; allowed: 8 to {MAX_CHART} each way")
    return Chart(0, height, width)


def _prepare_mesh(
    exemplar: Exemplar, surface: MeshSurface, options: SynthesisOptions, model: ModelFile | None
) -> Scene:
    if options.method != "quilt":
        raise InputError(f"method is {options.method!r} on a mesh; allowed there: 'quilt'")
    if isinstance(options.texels, tuple):
        width, height = options.texels
        raise InputError(f"texels is {width}x{height} on a mesh; allowed there: a number")
    scale = _scale(exemplar, surface, options, surface.mesh.metres)
    texels_a_step = _texels_a_step(scale)
    charted = charted_mesh(surface, mesh_charts(surface, scale.density / texels_a_step))
    asked = options.direction
    if asked is None:
        asked = "smooth" if options.stroke else default_direction(surface.mesh)
    ground = MapGround(charted, model, surface, False)
    return _on_charts(exemplar, ground, options, scale, texels_a_step, parse_direction(cast(str, asked)))


def _on_charts(
    exemplar: Exemplar,
    ground: MapGround,
    options: SynthesisOptions,
    scale: TextureScale,
    texels_a_step: float,
    direction: Direction,
) -> Scene:
    charted = ground.charted
    if direction.image is not None:
        charted = in_detail(charted, None if ground.model is None else ground.model.uv)
    if isinstance(ground.surface, Surface):
        direction = vectors_on_patches(ground.surface, charted, direction)
    mesh = charted.mesh
    for part, mask in zip(exemplar.parts, exemplar.masks, strict=True):
        check_level(mask, step_level(part.shape[:2], charted, scale.scale))
    field = direction_field(
        mesh,
        direction,
        strokes=options.stroke,
        crease=default_crease(mesh) if options.crease is None else options.crease,
        lattice=options.phase != 0 and any(lattice is not None for lattice in exemplar.lattices),
    )
    vectors, sizes = field.corner_vectors, None
    along, down = triangle_frames(mesh, vectors)
    turns = chart_turns(charted, along, field.fold)
    across = float(np.sqrt(scale.texels)) / scale.density * scale.scale
    block = _block_side(exemplar, options, across)
    if options.size_map is not None:
        wanted, wide = parse_size_map(options.size_map), block / scale.scale
        sizes, charted, vectors, parent = size_field(wanted, ground, charted, vectors, wide)
        turns, (along, down) = turns[parent], triangle_frames(charted.mesh, vectors)
    factors = None if sizes is None else sizes.factors
    fields = warp_fields(charted, along, down, scale.scale, turns, vectors, factors)
    phases = _phases(exemplar, options, charted, vectors, scale.scale, sizes)
    if any(one is not None for one in phases):
        block = _block_side(exemplar, options, across, phases)
    text = "strokes" if options.stroke and options.direction is None else direction.text
    return Scene(
        charted=charted,
        vectors=vectors,
        fields=fields,
        options=_own_options(options, block),
        turns=turns,
        fold=field.fold,
        scale=scale,
        density=texels_a_step,
        direction=f"{text}, {field.words}",
        field=field,
        sizes=sizes,
        phases=phases,
        steering=steering_on(ground, exemplar.guidance, block / scale.scale * scale.density / texels_a_step),
    )


def _phases(
    exemplar: Exemplar,
    options: SynthesisOptions,
    charted: ChartedSurface,
    vectors: FloatArray,
    scale: float,
    sizes: SizeField | None,
) -> tuple[PhaseField | CourseField | None, ...]:
    """Return the phases that a surface requests of each sample; `scale` is the sample's pixels per unit.

    The courses of a single sample may slip.
    """
    if options.phase == 0:
        return (None,) * len(exemplar.parts)
    fields = [
        None if lattice is None else phase_field(charted, vectors, scale, lattice.waves, sizes)
        for lattice in exemplar.lattices
    ]
    if len(fields) == 1 and fields[0] is not None:
        courses = find_courses(exemplar.lattices[0], find_joints(exemplar.parts[0]))
        if courses is not None:
            return (course_field(fields[0], courses, charted, vectors, scale, sizes) or fields[0],)
    return tuple(fields)


def _block_side(
    exemplar: Exemplar,
    options: SynthesisOptions,
    across: float,
    phases: tuple[PhaseField | CourseField | None, ...] | None = None,
) -> int:
    """Return the side of blocks on a surface; other parameters as in the function `block_side`."""
    if options.block is not None:
        return options.block
    sides = [
        block_side(part.shape, across, one)
        for part, one in zip(exemplar.parts, phases or (None,) * len(exemplar.parts), strict=True)
    ]
    return min(usable_side(max(sides), mask) for mask in exemplar.masks)


def _wanted_block(exemplar: Exemplar, options: SynthesisOptions) -> int:
    """Return the side of blocks in pixels: the requested one, or one that suits the samples.

    Raises
    ------
    InputError
        If a sample has no room for blocks of the requested size.
    """
    for part, used in zip(exemplar.parts, exemplar.masks, strict=True):
        most = min(512, 3 * min(part.shape[:2]) // 4)  # larger blocks leave no choice
        most = most if used is None else min(most, largest_block(used))
        if options.block is not None and not 8 <= options.block <= most:
            masked = "" if used is None else " with this mask"
            raise InputError(
                f"block is {options.block}; allowed: 8 to {most} in a sample of "
                f"{part.shape[1]}x{part.shape[0]} pixels{masked}"
            )
    if options.block is not None:
        return options.block
    side = max(
        suiting_side(
            part.shape, repeats=options.phase != 0 and lattice is not None and len(lattice.waves) > 1
        )
        for part, lattice in zip(exemplar.parts, exemplar.lattices, strict=True)
    )
    return min(usable_side(side, used) for used in exemplar.masks)


def _texels_a_step(scale: TextureScale) -> float:
    """Return the texels per step, each way: a step is about a pixel, or a texel if that is larger."""
    octaves = round(float(np.log2(scale.density / scale.scale)))
    return 2.0 ** min(max(octaves, 0), _MOST_OCTAVES)


def _scale(
    exemplar: Exemplar, surface: AnySurface, options: SynthesisOptions, metres: float | None
) -> TextureScale:
    """Return sizes of texels and sample on a surface whose unit may be known."""
    block = _wanted_block(exemplar, options)
    return texture_scale(
        surface,
        exemplar.parts[0].shape[1],
        sample_size=sample_width(exemplar.parts[0], options, metres),
        density=options.density,
        texels=cast(int | None, options.texels),
        block=block if options.block is not None else min(block, LEAST_SIDE),
    )


def sample_width(pixels: PixelArray, options: SynthesisOptions, metres: float | None) -> float | None:
    """Return the sample's width in model units, as requested or from its elements' width; None: neither.

    Raises
    ------
    InputError
        If a length has a unit and the model has none, or a size of elements is given and the sample does not
        repeat.
    """
    if options.sample_size is not None:
        return parse_length(options.sample_size, metres, name="sample size")
    if options.element_size is None:
        return None
    lattice = find_lattice(pixels)
    if lattice is None:
        raise InputError(
            f"element size is {options.element_size!r}, but no pattern clearly repeats in the sample; "
            "allowed: sample size"
        )
    length = parse_length(options.element_size, metres, name="element size")
    return float(length * pixels.shape[1] / max(lattice.element))
