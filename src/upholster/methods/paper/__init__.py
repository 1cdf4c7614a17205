"""Method "paper": blocks on every patch by the paper's rule, then edge blocks along the shared edges.

`method` has the steps, `matching` the coefficients that blocks are compared by, `edges` the shared edges.
"""

from upholster.methods.paper.method import PaperOptions, synthesize_paper

__all__ = ["PaperOptions", "synthesize_paper"]
