"""The plan by which blocks are laid: everything that stays the same for all parcels."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from upholster.charts.charted import ChartedSurface
from upholster.charts.size_map import SizeField
from upholster.charts.subdivision import subdivided_in
from upholster.methods.quilt._block_kernels import LayNumbers, LayWeights, MatchImage
from upholster.methods.quilt._sheet_kernels import FieldArrays
from upholster.methods.quilt.ground import PlacedGround, field_arrays, ground_of, whole_ground
from upholster.methods.quilt.guides import Asked
from upholster.methods.quilt.parcels import Parcels
from upholster.methods.quilt.phases import SurfacePhases
from upholster.methods.quilt.putting import PutPiece
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["LayPlan"]

_SHORT = 0.6
"""Maximum length of an edge of the triangles that blocks are unfolded over, in blocks."""

_RANGE = 8.0
"""Where blocks are more than this many times smaller than the largest, triangles have longer edges than
`_SHORT`. Otherwise the largest blocks would cover too many triangles."""


@dataclass(frozen=True, eq=False)
class LayPlan:
    """All parameters that stay the same while blocks are laid.

    Attributes
    ----------
    surface, vectors, fields
        As in `upholster.methods.quilt.method.planned`.
    turns, fold, crease
        Likewise; `turns` is (T,).
    shape
        (height, width) of the exemplar.
    scale
        Exemplar pixels per model unit.
    density
        Steps per model unit.
    match, numbers, weights
        The exemplar in its matching form, and the parameters of matching.
    overlap
        Overlap of neighbouring blocks on a grid, as a fraction of a block's side.
    phases
        The requested phases of each zone, or of the only sample; None: phases do not count.
    seed
        0 to 2^64 − 1.
    parcels
        The parcels of the surface.
    asked
        The requests to blocks; None: there are none.
    before
        The quilt of which a part is kept; None: there is none.
    put
        Pieces of the sample at places that the user chose.
    sizes
        Factor by which the sample is enlarged at each place; None: 1 everywhere.
    differs
        Whether steps that are not kept must differ from `before`.
    """

    surface: ChartedSurface
    vectors: FloatArray
    fields: tuple[WarpField, ...]
    turns: IntArray
    fold: int
    crease: float | None
    shape: tuple[int, int]
    scale: float
    density: float
    match: MatchImage
    numbers: LayNumbers
    weights: LayWeights
    overlap: float
    phases: tuple[SurfacePhases | None, ...]
    seed: int
    parcels: Parcels
    asked: Asked | None = None
    before: Quilt | None = None
    put: tuple[PutPiece, ...] = ()
    sizes: SizeField | None = None
    differs: bool = False

    @cached_property
    def in_rows(self) -> bool:
        """Whether blocks are laid in rows: on a flat texture in one parcel of which nothing is kept."""
        normals = self.surface.mesh.flat_normals
        single = len(self.parcels) == len(self.fields) == 1
        return self.before is None and single and bool((normals == normals[0]).all())

    @property
    def pixels(self) -> float:
        """Frame pixels per model unit."""
        return float(self.scale / 2**self.numbers.level)

    @cached_property
    def field(self) -> FieldArrays:
        """All warp fields in the kernels' form."""
        return field_arrays(self.fields, self.numbers.level)

    def ground(self, parcel: int, blocks: float, *, threads: int | None = 1) -> PlacedGround | None:
        """Return the bare ground within `blocks` blocks of a parcel; None: it contains no surface.

        `threads` is as in `upholster.parallel.run_tasks`.
        """
        box = self.parcels.box(parcel, blocks)
        longest = _SHORT * self.numbers.size / self.pixels
        longest *= 1.0 if self.sizes is None else max(self.sizes.least, self.sizes.most / _RANGE)
        how: dict[str, Any] = {"turns": self.turns, "fold": self.fold, "crease": self.crease}
        if box is None:
            whole = whole_ground(self.surface, self.vectors, self.field, longest, threads=threads, **how)
            return whole.bare(self.asked)
        fine = subdivided_in(self.surface, self.vectors, longest, box)
        return None if fine is None else ground_of(fine, self.field, threads=threads, **how).bare(self.asked)
