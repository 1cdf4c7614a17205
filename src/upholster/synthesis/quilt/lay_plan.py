"""The plan by which blocks are laid: everything that stays the same for all parcels."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from upholster.base.types import FloatArray
from upholster.charts.charted_surface import steps_per_unit
from upholster.charts.subdivision import subdivided_in
from upholster.quilt.model import Quilt
from upholster.synthesis.quilt.block_order import Near, near_blocks
from upholster.synthesis.quilt.ground import PlacedGround, field_arrays, ground_of, whole_ground
from upholster.synthesis.quilt.kernels._block_kernels import LayNumbers, LayWeights, MatchImage
from upholster.synthesis.quilt.kernels._sheet_kernels import FieldArrays
from upholster.synthesis.quilt.parcels import Parcels
from upholster.synthesis.quilt.scene import Scene

__all__ = ["LayPlan"]

_OVERLAP = 0.3
"""Default overlap of blocks, as a fraction of their side."""

_SHORT = 0.6
"""Maximum length of an edge of the triangles that blocks are unfolded over, in blocks."""

_RANGE = 8.0
"""Where blocks are more than this many times smaller than the largest, triangles have longer edges than
`_SHORT`. Otherwise the largest blocks would cover too many triangles."""


@dataclass(frozen=True, eq=False)
class LayPlan:
    """All parameters that stay the same while blocks are laid; tasks pickle and hash it.

    Attributes
    ----------
    scene
        The surface, and the requests to blocks.
    shape
        (height, width) of the exemplar.
    match, numbers, weights
        The exemplar in its matching form, and the parameters of matching.
    parcels
        The parcels of the surface.
    seed
        0 to 2^64 − 1.
    has_tones
        As for `Quilt`.
    """

    scene: Scene
    shape: tuple[int, int]
    match: MatchImage
    numbers: LayNumbers
    weights: LayWeights
    parcels: Parcels
    seed: int
    has_tones: bool = False

    @cached_property
    def in_rows(self) -> bool:
        """Whether blocks are laid in rows: on a flat texture in one parcel of which nothing is kept."""
        normals = self.scene.charted.mesh.flat_normals
        single = len(self.parcels) == len(self.scene.fields) == 1
        return self.before is None and single and bool((normals == normals[0]).all())

    @property
    def before(self) -> Quilt | None:
        """The quilt of which a part is kept; None: there is none."""
        kept = self.scene.steering.kept
        return None if kept is None else kept[0]

    @property
    def pixels(self) -> float:
        """Frame pixels per model unit."""
        return float(self.scene.pixels / 2**self.numbers.level)

    @cached_property
    def steps_per_unit(self) -> float:
        """Steps per model unit."""
        return steps_per_unit(self.scene.charted)

    @property
    def cells(self) -> int:
        """Number of cells of a block's mask."""
        return (self.numbers.size // self.numbers.cell) ** 2

    @property
    def overlap(self) -> float:
        """Overlap of neighbouring blocks on a grid, as a fraction of a block's side."""
        options = self.scene.options
        return _OVERLAP if options.overlap is None else options.overlap / options.block

    @cached_property
    def field(self) -> FieldArrays:
        """All warp fields in the kernels' form."""
        return field_arrays(self.scene.fields, self.numbers.level)

    def near(self, spots: FloatArray, blocks: float, *, first: int = 0) -> Near:
        """Return for each of some points (n, 3), from `first` on, the others within `blocks` blocks of it."""
        tile = self.scene.charted.mesh.box if self.scene.charted.is_tile else None
        return near_blocks(spots, blocks * self.parcels.block, tile, first=first)

    def ground(self, parcel: int, blocks: float) -> PlacedGround | None:
        """Return the bare ground within `blocks` blocks of a parcel; None: it contains no surface."""
        scene, box = self.scene, self.parcels.box(parcel, blocks)
        longest = _SHORT * self.numbers.size / self.pixels
        longest *= 1.0 if scene.sizes is None else max(scene.sizes.least, scene.sizes.most / _RANGE)
        how: dict[str, Any] = {"turns": scene.turns, "fold": scene.fold, "crease": scene.options.crease}
        if box is None:
            placed = whole_ground(scene.charted, scene.vectors, self.field, longest, **how)
        elif (fine := subdivided_in(scene.charted, scene.vectors, longest, box)) is None:
            return None
        else:
            placed = ground_of(fine, self.field, **how)
        kept = scene.steering.places(self.numbers)
        return placed.bare(scene.steering.wanted, scene.steering.zones, kept)
