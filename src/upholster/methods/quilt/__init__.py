"""Method "quilt": one texture over a whole charted surface, block by block.

`method` has the steps; `centres` tells where blocks lie and in which order, `ground` what they lie on,
`match_pyramid` and `features` what they are compared by, `exemplar_structure` their size, `emit` what shows
of them.
"""

from upholster.methods.quilt.method import synthesize_quilt
from upholster.methods.quilt.quilt_options import QuiltOptions

__all__ = ["QuiltOptions", "synthesize_quilt"]
