"""Method "paper": blocks on every patch by the paper's rule, then edge blocks along the shared edges.

`method` has the steps, `matching` the coefficients by which blocks are compared, `strips` the shared edges,
`layers` the chosen blocks as a quilt, `coefficients` the threshold of equation 7.
"""

from upholster.methods.paper.coefficients import keep_coefficients
from upholster.methods.paper.method import PaperOptions, synthesize_paper

__all__ = ["PaperOptions", "keep_coefficients", "synthesize_paper"]
