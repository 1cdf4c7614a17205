"""The phase of a repeating texture over a surface: where in its period it shall be, so that courses close.

A *wave* is one generator of the sample's lattice (`upholster.lattice`): cycles per exemplar pixel. The
surface is cut into *cells*, and *links* between neighbouring cells tell how far each wave goes on from one to
the next. `solving` finds the phases that follow all links best. `chart_cells` makes cells and links of
charts, for `field`, and `mesh_cells` those of meshes: both tell the wanted phase anywhere.
`warping` lets warp fields give way to the phases, and `calming` turns them where directions turn faster than
courses can follow.

References
----------
F. Knöppel, K. Crane, U. Pinkall, P. Schröder: Stripe patterns on surfaces, ACM Transactions on Graphics 34,
2015. Here the unknowns are on cells, and a wave that comes back as its opposite is solved with it, which
is their double cover.
"""

from upholster.charts.phases.field import TURN, PhaseField, StraightPhases, phase_field
from upholster.charts.phases.mesh_cells import MeshPhases, mesh_phases
from upholster.charts.phases.warping import warped

__all__ = ["TURN", "MeshPhases", "PhaseField", "StraightPhases", "mesh_phases", "phase_field", "warped"]
