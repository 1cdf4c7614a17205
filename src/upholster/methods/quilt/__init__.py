"""Method "quilt": one texture over the whole surface, chart after chart, block after block.

`method` has the steps; `match_pyramid` and `features` what blocks are compared by, `structure` the block
size, `grid` where a chart's blocks lie, `transfer` what finished charts leave on it, `lay` how its own are
chosen, cut and laid, `refinement` what is laid over the worst cuts then.
"""

from upholster.methods.quilt.method import synthesize_quilt
from upholster.methods.quilt.options import QuiltOptions

__all__ = ["QuiltOptions", "synthesize_quilt"]
