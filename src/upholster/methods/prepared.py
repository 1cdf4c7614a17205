"""A prepared synthesis: its complete settings, variants of them, and the quilt that they give."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.charts.charted import ChartedSurface, on_longer_steps
from upholster.charts.directions import DirectionField
from upholster.charts.layout import TextureScale
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.size_map import SizeField
from upholster.errors import InputError
from upholster.geometry import AnySurface, Surface
from upholster.image.masks import Used
from upholster.methods.paper.method import PaperOptions, synthesize_paper
from upholster.methods.pixel.method import PixelOptions, synthesize_pixel
from upholster.methods.quilt.guides import Again, Steering, on_charts
from upholster.methods.quilt.lay_plan import LayPlan
from upholster.methods.quilt.method import laid_quilt, planned
from upholster.methods.quilt.phases import WantedPhases
from upholster.methods.quilt.quilt_options import QuiltOptions
from upholster.methods.quilt.sizes import LARGEST_SIDE
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.painting import PAINTED_DENSITIES, painted_charts
from upholster.quilt.warp_field import WarpField
from upholster.stages import stage
from upholster.types import FloatArray, IntArray, PixelArray, Progress

__all__ = ["Prepared", "coarser", "execute", "holding", "lay_plan"]


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
    block = min(2 * options.block, 3 * min(exemplar.shape[:2]) // 4, LARGEST_SIDE)
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
            kept = replace(prepared.steering or Steering(), kept=(quilt, region.stays), differs=True)
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
