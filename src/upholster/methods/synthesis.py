"""From an exemplar and a surface to a quilt: layout, scale, direction and method are all set here."""

import secrets
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import (
    ChartedSurface,
    charted_mesh,
    charted_patches,
    charted_plane,
    on_longer_steps,
)
from upholster.charts.creases import default_crease
from upholster.charts.directions import (
    Direction,
    DirectionField,
    default_direction,
    default_on_patches,
    direction_field,
    in_detail,
    is_direction_image,
    is_stroke_file,
    parse_direction,
    told_on_patches,
)
from upholster.charts.layout import LONGEST, TextureScale, density_layout, texture_scale, uniform_layout
from upholster.charts.maps import MapGround
from upholster.charts.mesh_layout import mesh_charts
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.size_map import SizeField, parse_size_map, size_field
from upholster.charts.surface_to_cover import CoveredLike, as_covered
from upholster.charts.turns import chart_turns
from upholster.elements import find_lattice
from upholster.errors import InputError
from upholster.geometry import AnySurface, MeshSurface, Surface
from upholster.geometry.mesh_files import ModelFile
from upholster.image import Material, check_exemplar
from upholster.image.masks import Used
from upholster.image.source import Sample, Source, as_exemplar, used_pixels
from upholster.lengths import parse_length
from upholster.methods.guidance import Guidance
from upholster.methods.guided import guidance_files, read_guidance
from upholster.methods.paper.coefficients import keep_coefficients
from upholster.methods.paper.method import PaperOptions, synthesize_paper
from upholster.methods.pixel.method import PixelOptions, check_sample, synthesize_pixel
from upholster.methods.quilt.guides import Again, Steering, on_charts
from upholster.methods.quilt.laying import LayPlan
from upholster.methods.quilt.method import laid_quilt, planned, step_level
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.quilt_options import QuiltOptions
from upholster.methods.quilt.sizes import turning_of
from upholster.methods.quilt.usable import check_level, check_used
from upholster.methods.seen import Seen
from upholster.options import SampleOptions, SynthesisOptions, chosen, settled_options
from upholster.parallel import check_running
from upholster.quilt.chart import MAX_CHART, Chart
from upholster.quilt.model import Quilt
from upholster.quilt.painting import PAINTED_DENSITIES, painted_charts
from upholster.quilt.warp_field import WarpField
from upholster.stages import file_stage, keeping, stage
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = [
    "Prepared",
    "asked_files",
    "coarser",
    "execute",
    "holding",
    "kept_sample",
    "lay_plan",
    "matched_image",
    "needs_patches",
    "prepare",
    "settled_seed",
    "synthesize",
]

_SURFACE_PHASE, _FLAT_PHASE = 2.0, 0.5
"""Default cost of being out of phase. It is higher on a surface, where courses do not close by themselves."""

_MOST_OCTAVES = 6
"""Texels per step are at most 2^6 each way, as in `Quilt.density`."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """The settings of a synthesis, complete and checked before it begins.

    Attributes
    ----------
    charts, fields
        The layout; fields are empty if the method does not use them.
    scale
        Sizes of texels and sample on the surface; None if they were not requested (methods "paper" and
        "pixel", flat textures).
    direction
        In words; empty if there is none.
    options
        The method's options, with all values set.
    field
        The direction of the sample's rows on a mesh.
    phases
        The wanted phases of a sample that repeats; None if it does not, or phases are not requested.
    turns
        (T,) on a mesh, quarter turns from the warp fields to the wanted phases: see `upholster.charts.turns`.
    charted
        The charted surface on which method "quilt" lays blocks.
    vectors
        (T, 3, 3) direction of the sample's rows at its triangles' corners.
    density
        Texels per step of the charts, each way: a power of two.
    used
        (H, W) the pixels of the sample that blocks may show; None: all.
    steering
        Requests for what blocks show where; None: none.
    again
        Regions that are laid again, one after another.
    held
        For each chart (height, width), where another quilt is kept, see `holding`; None: nowhere.
    sizes
        Factor of the sample's size at the corners of `charted`; None: 1.
    """

    charts: tuple[Chart, ...]
    fields: tuple[WarpField, ...]
    scale: TextureScale | None
    direction: str
    options: QuiltOptions | PaperOptions | PixelOptions
    field: DirectionField | None = None
    phases: WantedPhases | None = None
    turns: IntArray | None = None
    charted: ChartedSurface | None = None
    vectors: FloatArray | None = None
    density: float = 1.0
    used: Used | None = None
    steering: Steering | None = None
    again: tuple[Again, ...] = ()
    held: tuple[NDArray[np.bool_], ...] | None = None
    sizes: SizeField | None = None

    @property
    def painted(self) -> tuple[Chart, ...]:
        """The charts at their painted size, in texels."""
        return painted_charts(self.charts, self.density)


def kept_sample(exemplar: PixelArray | Material, options: SynthesisOptions) -> PixelArray | Material:
    """Return a sample as it is matched and painted: without small coefficients if the options say so.

    Each map of a material is treated separately.

    Raises
    ------
    InputError
        If `exemplar` is an array but not a valid exemplar.
    """
    if options.threshold is None and options.coefficients is None:
        return exemplar

    return _kept(exemplar, options.levels, options.threshold, options.coefficients)


@stage
def _kept(
    exemplar: PixelArray | Material, levels: int, threshold: float | None, coefficients: float | None
) -> PixelArray | Material:
    how: dict[str, Any] = {"levels": levels, "threshold": threshold, "coefficients": coefficients}
    if isinstance(exemplar, Material):
        kept = {role: keep_coefficients(image, **how) for role, image in exemplar.maps.items()}
        return Material(kept, used=exemplar.used)
    return keep_coefficients(check_exemplar(exemplar), **how)


def needs_patches(options: SynthesisOptions) -> bool:
    """Return whether the options require patches, and cannot be used on a mesh."""
    along = options.direction
    on_patches = callable(along) or (isinstance(along, str) and along.strip() in ("u", "v"))
    on_patches = on_patches or is_direction_image(along)
    return options.method != "quilt" or on_patches or isinstance(options.texels, tuple)


def settled_seed(seed: int | None) -> int:
    """Return a seed as a number; for None a new one, drawn from the system.

    Raises
    ------
    InputError
        If it is neither None nor 0 to 2^63 − 1.
    """
    if seed is None:
        return secrets.randbits(32)
    if not (isinstance(seed, Integral) and 0 <= seed < 2**63):
        raise InputError(f"seed is {seed!r}; allowed: 0 to 2^63 - 1")
    return int(seed)


def matched_image(exemplar: PixelArray | Material, options: SynthesisOptions) -> PixelArray:
    """Return the image to match: for "quilt" all maps of a material that count, otherwise the base colour.

    Returns
    -------
    ndarray
        (H, W, C), with as many channels as needed.

    Raises
    ------
    InputError
        If `exemplar` is an array but not a valid exemplar.
    """
    if isinstance(exemplar, Material):
        turned = options.mirror or options.rotate
        return _matched_maps(exemplar, turned) if options.method == "quilt" else _color(exemplar)
    return check_exemplar(exemplar)


@stage
def _matched_maps(material: Material, turned: bool) -> PixelArray:
    return material.matched(turned=turned)


@stage
def _color(material: Material) -> PixelArray:
    return material.color()


def asked_files(options: SynthesisOptions) -> list[str]:
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
    _made: Prepared, _exemplar: PixelArray, _surface: AnySurface, options: SynthesisOptions, **_more: object
) -> list[str]:
    return asked_files(options)


@file_stage(_inputs)
def prepare(
    exemplar: PixelArray,
    surface: AnySurface,
    options: SynthesisOptions,
    *,
    largest: int = LONGEST,
    model: ModelFile | None = None,
    used: Used | None = None,
    guidance: Guidance | None = None,
) -> Prepared:
    """Set up what `synthesize` will do; parameters are as for `synthesize`.

    On patches no chart of method "quilt" is longer than `largest` texels. `model` is the file that a mesh was
    read from. Blocks only show `used` pixels, (H, W) bool; None: all. `guidance` steers where they go.

    Raises
    ------
    InputError
        If something is out of range on this surface, or with this exemplar.
    """
    check_used(used, options.method)
    seen = Seen(exemplar, used, guidance)
    if isinstance(surface, MeshSurface):
        return _prepare_mesh(seen, surface, options, model)
    if options.method == "paper":
        charts = uniform_layout(surface, chart=options.chart)
        return Prepared(charts, (), None, "", settled_options(options, PaperOptions))
    if options.method == "pixel":
        check_sample(exemplar.shape[:2], options.levels)
        charts = uniform_layout(surface, chart=options.chart)
        return Prepared(charts, (), None, "", settled_options(options, PixelOptions))
    if isinstance(options.texels, tuple):
        return _prepare_flat(seen, surface, _flat_chart(surface, *options.texels), options)
    scale = _scale(seen, surface, options, None)
    density = _texels_a_step(scale)
    steps = scale.density / density
    charts = density_layout(surface, density=steps, largest=max(1, int(largest / density)))
    charted = charted_patches(surface, charts)
    asked = options.direction
    if asked is None:
        asked = "smooth" if options.stroke else default_on_patches(surface, charted)
    wanted = parse_direction(cast(str, asked), patches=True)
    ground = MapGround(charted, None, surface, False)
    return _on_charts(seen, ground, options, scale, density, wanted)


def _prepare_flat(seen: Seen, surface: AnySurface, chart: Chart, options: SynthesisOptions) -> Prepared:
    # A flat texture: a step is a pixel, and the sample's rows run along rows.
    if options.size_map is not None:
        raise InputError("size_map is given for a flat texture; allowed: on surfaces and models")
    for name in ("crease", "stroke"):
        if getattr(options, name) is not None:
            raise InputError(f"{name} is given for a flat texture; allowed: none, its rows run to the right")
    charted = charted_plane(chart, tile=options.tileable)
    vectors = np.broadcast_to((1.0, 0.0, 0.0), (len(charted.chart), 3, 3))
    ground = MapGround(charted, None, surface, True)
    phases = seen.wanted_phases(options, _FLAT_PHASE, charted, vectors, 1.0)
    own = settled_options(options, QuiltOptions, block=seen.wanted_block(options))
    turns = np.zeros(len(vectors), np.int32)
    return Prepared(
        (chart,),
        (WarpField.identity(),),
        None,
        "",
        own,
        None,
        phases[0],
        turns,
        charted,
        vectors,
        used=seen.used,
        steering=seen.steering(ground, own.block, phases),
        again=seen.again(ground),
        held=seen.held(ground),
    )


def _on_charts(
    seen: Seen,
    ground: MapGround,
    options: SynthesisOptions,
    scale: TextureScale,
    density: float,
    direction: Direction,
) -> Prepared:
    charted = ground.charted
    if direction.image is not None:
        charted = in_detail(charted, None if ground.model is None else ground.model.uv)
    if isinstance(ground.surface, Surface):
        direction = told_on_patches(ground.surface, charted, direction)
    mesh = charted.mesh
    for part, mask in zip(seen.parts, seen.masks, strict=True):
        check_level(mask, step_level(part.shape[:2], charted, scale.scale))
    field = direction_field(
        mesh,
        direction,
        strokes=options.stroke,
        crease=default_crease(mesh) if options.crease is None else options.crease,
        lattice=any(lattice is not None for lattice in seen.lattices(options, _SURFACE_PHASE)),
    )
    vectors, sizes = field.corner_vectors, None
    along, down = triangle_frames(mesh, vectors)
    turns = chart_turns(charted, along, field.fold)
    turning = turning_of(charted, vectors, field.fold) / scale.scale
    across = float(np.sqrt(scale.texels)) / scale.density * scale.scale
    block = seen.block_side(options, across, turning)
    if options.size_map is not None:
        wanted, wide = parse_size_map(options.size_map), block / scale.scale
        sizes, charted, vectors, parent = size_field(wanted, ground, charted, vectors, wide)
        turns, (along, down) = turns[parent], triangle_frames(charted.mesh, vectors)
    factors = None if sizes is None else sizes.factors
    fields = warp_fields(charted, along, down, scale.scale, turns, vectors, factors)
    phases = seen.wanted_phases(options, _SURFACE_PHASE, charted, vectors, scale.scale, sizes)
    if any(one is not None for one in phases):
        block = seen.block_side(options, across, turning, phases)
    own = settled_options(options, QuiltOptions, block=block)
    text = "strokes" if options.stroke and options.direction is None else direction.text
    return Prepared(
        charted.charts,
        fields,
        scale,
        f"{text}, {field.words}",
        own,
        field,
        phases[0],
        turns,
        charted,
        vectors,
        density=density,
        used=seen.used,
        sizes=sizes,
        steering=seen.steering(ground, block / scale.scale * scale.density / density, phases),
        again=seen.again(ground),
        held=seen.held(ground),
    )


def _prepare_mesh(
    seen: Seen, surface: MeshSurface, options: SynthesisOptions, model: ModelFile | None
) -> Prepared:
    if options.method != "quilt":
        raise InputError(f"method is {options.method!r} on a mesh; allowed there: 'quilt'")
    if isinstance(options.texels, tuple):
        width, height = options.texels
        raise InputError(f"texels is {width}x{height} on a mesh; allowed there: a number")
    scale = _scale(seen, surface, options, surface.mesh.metres)
    density = _texels_a_step(scale)
    charted = charted_mesh(surface, mesh_charts(surface, scale.density / density))
    asked = options.direction
    if asked is None:
        asked = "smooth" if options.stroke else default_direction(surface.mesh)
    ground = MapGround(charted, model, surface, False)
    return _on_charts(seen, ground, options, scale, density, parse_direction(cast(str, asked)))


@stage
def coarser(prepared: Prepared, exemplar: PixelArray, octaves: int) -> Prepared:
    """Return the settings for a quick look at the same texture: longer steps, and blocks twice as wide.

    Directions, phases and sizes are those of `prepared`, for method "quilt".

    Parameters
    ----------
    prepared, exemplar
        The result of `prepare`, and its exemplar.
    octaves
        Steps are longer by this many powers of two, 1 to 6.
    """
    options = prepared.options
    assert prepared.charted is not None
    assert prepared.vectors is not None
    assert isinstance(options, QuiltOptions)
    charted = on_longer_steps(prepared.charted, octaves)
    along, down = triangle_frames(charted.mesh, prepared.vectors)
    scale = 1.0 if prepared.scale is None else prepared.scale.scale
    factors = None if prepared.sizes is None else prepared.sizes.factors
    block = min(2 * options.block, 3 * min(exemplar.shape[:2]) // 4)
    return replace(
        prepared,
        charts=charted.charts,
        charted=charted,
        fields=warp_fields(charted, along, down, scale, prepared.turns, prepared.vectors, factors),
        options=replace(options, block=block, overlap=None),
        density=min(prepared.density * 2.0**octaves, PAINTED_DENSITIES[1]),
        steering=prepared.steering and prepared.steering.on_charts(prepared.charts, charted.charts),
        again=tuple(one.on_charts(charted.charts) for one in prepared.again),
        held=None if prepared.held is None else on_charts(prepared.held, charted.charts),
    )


@stage
def holding(prepared: Prepared, before: Quilt) -> Prepared:
    """Return the settings for keeping the regions `prepared.held` as they are in another quilt.

    Raises
    ------
    InputError
        If that quilt has other charts, directions or sizes.
    """
    assert prepared.held is not None
    same = before.charts == prepared.charts and all(
        np.array_equal(one.nodes, other.nodes)
        for one, other in zip(before.fields, prepared.fields, strict=True)
    )
    if not same:
        raise InputError(
            "a pinned region cannot stay where model, sizes, texels or directions change; allowed: unpin it"
        )
    steering = replace(prepared.steering or Steering(), kept=(before, prepared.held))
    again = tuple(
        replace(one, stays=tuple(own | held for own, held in zip(one.stays, prepared.held, strict=True)))
        for one in prepared.again
    )
    return replace(prepared, steering=steering, again=again)


def _texels_a_step(scale: TextureScale) -> float:
    """Return the texels per step, each way: a step is about a pixel, or a texel if that is larger."""
    octaves = round(float(np.log2(scale.density / scale.scale)))
    return 2.0 ** min(max(octaves, 0), _MOST_OCTAVES)


def _scale(seen: Seen, surface: AnySurface, options: SynthesisOptions, metres: float | None) -> TextureScale:
    """Return sizes of texels and sample on a surface whose unit may be known."""
    return texture_scale(
        surface,
        seen.parts[0].shape[1],
        sample_size=sample_width(seen.parts[0], options, metres),
        density=options.density,
        texels=cast(int | None, options.texels),
        block=seen.wanted_block(options),
    )


def sample_width(exemplar: PixelArray, options: SynthesisOptions, metres: float | None) -> float | None:
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
    lattice = find_lattice(exemplar)
    if lattice is None:
        raise InputError(
            f"element size is {options.element_size!r}, but no pattern clearly repeats in the sample; "
            "allowed: sample size"
        )
    length = parse_length(options.element_size, metres, name="element size")
    return float(length * exemplar.shape[1] / max(lattice.element))


def _flat_chart(surface: Surface, width: int, height: int) -> Chart:
    if len(surface.patches) != 1:
        raise InputError(
            f"texels is {width}x{height} on {len(surface.patches)} patches; allowed there: a number"
        )
    if not (8 <= width <= MAX_CHART and 8 <= height <= MAX_CHART):
        raise InputError(f"texels is {width}x{height}; allowed: 8 to {MAX_CHART} each way")
    return Chart(0, height, width)


@stage
def execute(
    prepared: Prepared,
    exemplar: PixelArray,
    surface: AnySurface,
    *,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Synthesise as prepared; the exemplar may have any number of channels here.

    Raises
    ------
    InputError
        If the seed or the number of threads is out of range, or the exemplar too small.
    """
    run: dict[str, Any] = {"seed": seed, "threads": threads, "progress": progress}
    charts, options = prepared.charts, prepared.options
    if isinstance(options, QuiltOptions):
        quilt = laid_quilt(lay_plan(prepared, exemplar, seed=seed), threads, progress)
        for region in prepared.again:
            kept = replace(prepared.steering or Steering(), kept=(quilt, region.stays))
            plan = lay_plan(replace(prepared, steering=kept), exemplar, seed=region.seed)
            quilt = laid_quilt(plan, threads, progress)
        return quilt.on(surface, seed=seed, density=prepared.density)
    assert isinstance(surface, Surface)
    if isinstance(options, PaperOptions):
        quilt = synthesize_paper(exemplar, surface, charts, options=options, **run)
    else:
        assert isinstance(options, PixelOptions)
        quilt = synthesize_pixel(exemplar, surface, charts, options=options, **run)
    return quilt.on(surface, seed=seed, density=prepared.density)


def lay_plan(prepared: Prepared, exemplar: PixelArray, *, seed: int = 0) -> LayPlan:
    """Return the plan by which method "quilt" lays a surface, as prepared."""
    assert prepared.charted is not None
    assert prepared.vectors is not None  # method "quilt" has both
    assert isinstance(prepared.options, QuiltOptions)
    return planned(
        exemplar,
        prepared.charted,
        prepared.fields,
        prepared.vectors,
        1.0 if prepared.scale is None else prepared.scale.scale,
        fold=1 if prepared.field is None else prepared.field.fold,
        turns=prepared.turns,
        options=prepared.options,
        phases=prepared.phases,
        sizes=prepared.sizes,
        used=prepared.used,
        steering=prepared.steering,
        seed=seed,
    )


def synthesize(
    exemplar: PixelArray | Material | Source | Sample,
    surface: CoveredLike,
    *,
    options: SynthesisOptions | None = None,
    seed: int | None = 0,
    threads: int | None = None,
    progress: Progress | None = None,
    **choices: Any,
) -> Quilt:
    """Synthesise texture over a surface.

    Parameters
    ----------
    exemplar
        (H, W) or (H, W, C) with 1 to 4 channels, 32×32 to 4096×4096; uint8, uint16 or float. Or a
        material: its maps are matched together, or by methods "paper" and "pixel" its base colour alone. Or
        the path of an image, or of a material's folder; or a `Sample`, which may name a mask.
    surface
        The surface to cover; or its text form, ``"torus:R=2,r=0.7"``, or the path of its file. Or a mesh,
        which is laid out flat first; or one that is already laid out, see `upholster.charts.unwrap`.
    options
        Method, scale, direction and all other choices; see `upholster.SynthesisOptions`.
    seed
        0 to 2^63 − 1. The same seed gives the same quilt, whatever the number of threads and on any machine.
        None draws a random seed, which `Quilt.seed` records.
    threads
        1 to 256; by default one per core.
    progress
        Called as ``progress(stage, done, total)``, with stages "blocks" and, for method "paper", "seams"; for
        method "pixel" "texels".
    choices
        Single options, by their names in `upholster.SynthesisOptions`. They override `options`, and None is
        as if not given. The most useful ones: `method`, "quilt" (one texture at true scale
        over the whole surface), "paper" (the paper's, patch by patch) or "pixel" (texel by texel); `texels`,
        a number, or (width, height) of a flat texture; `sample_size`, the exemplar's width in model units;
        `direction`, in words, as degrees, as a vector (x, y, z) or as a function, see
        `upholster.charts.directions.parse_direction`.

    Returns
    -------
    Quilt
        Charts and placements; `upholster.paint` turns it into texels. With `threshold` or `coefficients` it
        is matched against the result of `upholster.methods.kept_sample`, which is then the sample to paint.

    Raises
    ------
    InputError
        If something is unknown, out of range or does not fit together, before any work is done.
    """
    wanted = chosen(SynthesisOptions, options, **choices)
    if isinstance(exemplar, Sample) and exemplar.size is not None:
        wanted = replace(wanted, sample_size=exemplar.size, element_size=None)
    check_running(threads, progress)
    seed, covered = settled_seed(seed), as_covered(surface, patches=needs_patches(wanted))
    surface, metres = covered.surface, None
    if isinstance(surface, MeshSurface):
        metres = surface.mesh.metres
    reading = exemplar.options if isinstance(exemplar, Sample) else SampleOptions()
    source, guidance = read_guidance(wanted, as_exemplar(exemplar), reading, metres)
    source = kept_sample(source, wanted)
    checked, used = matched_image(source, wanted), used_pixels(source)
    with keeping():
        prepared = prepare(checked, surface, wanted, model=covered.model, used=used, guidance=guidance)
        return execute(prepared, checked, surface, seed=seed, threads=threads, progress=progress)
