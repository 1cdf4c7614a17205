"""The phase of a repeating texture over a surface: its place in the period, chosen so that courses close.

A *wave* is one generator of the sample's lattice (`upholster.image.elements`), in cycles per exemplar pixel.
The surface is cut into *cells*. *Links* between neighbouring cells (`links`) give the advance of each wave
from one to the next. `phase_solution` finds the phases that fit all links best. `phase_cells` makes cells and
links, and evaluates the wanted phase anywhere. `course_phases` finds the phases of courses that slip.

References
----------
F. Knöppel, K. Crane, U. Pinkall, P. Schröder: Stripe patterns on surfaces, ACM Transactions on Graphics 34,
2015. Here the unknowns are on cells, and a wave that returns as its opposite is solved together with it; this
is their double cover.
"""
