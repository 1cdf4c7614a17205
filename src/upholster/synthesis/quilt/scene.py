"""The scene: a surface as blocks cover it, laid out in charts, with all options set."""

from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.charted_surface import ChartedSurface, on_longer_steps
from upholster.charts.directions.field import DirectionField
from upholster.charts.layout import TextureScale
from upholster.charts.mesh_warp_fields import triangle_frames, warp_fields
from upholster.charts.size_map import SizeField
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.painting import PAINTED_DENSITIES, painted_charts
from upholster.quilt.warp_field import WarpField
from upholster.runtime.stages import stage
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.phases import SurfacePhases
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.quilt.sizes import LARGEST_SIDE
from upholster.synthesis.quilt.steering import Steering

__all__ = ["Scene", "coarser", "holding"]


@dataclass(frozen=True, eq=False)
class Scene:
    """A surface as method "quilt" covers it: nothing of the sample's size, because tasks pickle it.

    Attributes
    ----------
    charted
        The charted surface on which blocks are laid.
    vectors
        (T, 3, 3), unit vectors at its triangles' corners: the direction of the sample's rows.
    fields
        The charts' warp fields.
    options
        The method's options, with all values set; without directions, which are `vectors` here.
    turns, fold
        (T,) quarter turns from the warp fields to the directions, see `upholster.charts.turns`; and 1, 2 or
        4: this many evenly rotated directions count as one where a block extends from triangle to triangle.
    scale
        Sizes of texels and sample on the surface; None: a flat texture, of a pixel per step.
    density
        Texels per step of the charts, each way: a power of two.
    direction
        In words; empty if there is none.
    field
        The direction of the sample's rows on a mesh.
    sizes
        Factor of the sample's size at the corners of `charted`; None: 1.
    phases
        For each sample the phases that the surface requests of it; None: they do not count.
    steering
        The requests to blocks.
    """

    charted: ChartedSurface
    vectors: FloatArray
    fields: tuple[WarpField, ...]
    options: QuiltOptions
    turns: IntArray
    fold: int = 1
    scale: TextureScale | None = None
    density: float = 1.0
    direction: str = ""
    field: DirectionField | None = None
    sizes: SizeField | None = None
    phases: tuple[SurfacePhases | None, ...] = (None,)
    steering: Steering = dataclass_field(default_factory=Steering)

    @property
    def charts(self) -> tuple[Chart, ...]:
        """The layout, in steps."""
        return self.charted.charts

    @property
    def painted(self) -> tuple[Chart, ...]:
        """The charts at their painted size, in texels."""
        return painted_charts(self.charts, self.density)

    @property
    def waves(self) -> FloatArray | None:
        """(n, 2) the waves whose phases the surface requests of the first sample; None: of none."""
        return None if self.phases[0] is None else self.phases[0].waves

    @property
    def pixels(self) -> float:
        """Pixels of the sample per model unit."""
        return 1.0 if self.scale is None else self.scale.scale


@stage
def coarser(scene: Scene, exemplar: Exemplar, octaves: int) -> Scene:
    """Return the scene for a quick look at the same texture: longer steps, and blocks twice as wide.

    Directions, phases and sizes stay as they are. Steps are longer by `octaves` powers of two, 1 to 6.
    """
    charted = on_longer_steps(scene.charted, octaves)
    along, down = triangle_frames(charted.mesh, scene.vectors)
    factors = None if scene.sizes is None else scene.sizes.factors
    block = min(2 * scene.options.block, 3 * min(exemplar.shape) // 4, LARGEST_SIDE)
    return replace(
        scene,
        charted=charted,
        fields=warp_fields(charted, along, down, scene.pixels, scene.turns, scene.vectors, factors),
        options=replace(scene.options, block=block, overlap=None),
        density=min(scene.density * 2.0**octaves, PAINTED_DENSITIES[1]),
        steering=scene.steering.on_charts(scene.charts, charted.charts),
    )


@stage
def holding(scene: Scene, before: Quilt) -> Scene:
    """Return the scene in which the regions `steering.held` stay as they are in another quilt.

    Raises
    ------
    InputError
        If that quilt has other charts, directions or sizes.
    """
    same = before.charts == scene.charts and all(
        np.array_equal(one.nodes, other.nodes) for one, other in zip(before.fields, scene.fields, strict=True)
    )
    if not same:
        raise InputError(
            "a pinned region cannot stay where model, sizes, texels or directions change; allowed: unpin it"
        )
    return replace(scene, steering=scene.steering.holding(before))
