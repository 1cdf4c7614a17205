"""The phase of a repeating texture over a surface: where in its period it shall be, so that courses close.

A *wave* is one generator of the sample's lattice (`upholster.elements`): cycles per exemplar pixel. The
surface is cut into *cells*, and *links* between neighbouring cells tell how far each wave goes on from one to
the next. `phase_solving` finds the phases that follow all links best; `phase_cells` makes cells and links,
and tells the wanted phase anywhere.

References
----------
F. Knöppel, K. Crane, U. Pinkall, P. Schröder: Stripe patterns on surfaces, ACM Transactions on Graphics 34,
2015. Here the unknowns are on cells, and a wave that comes back as its opposite is solved with it, which
is their double cover.
"""

from upholster.charts.phases.phase_cells import TURN, PhaseField, phase_field

__all__ = ["TURN", "PhaseField", "phase_field"]
