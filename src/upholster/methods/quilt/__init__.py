"""Method "quilt": one texture over a complete charted surface, block by block.

`method` runs the steps. `centres` chooses the blocks' centres and their order, and `ground` holds the surface
on which blocks are laid. `match_pyramid` and `features` make the values by which blocks are compared.
`exemplar_structure` measures the size that blocks need. `emit` turns their visible parts into placements and
labels.
"""

from upholster.methods.quilt.method import synthesize_quilt
from upholster.methods.quilt.quilt_options import QuiltOptions

__all__ = ["QuiltOptions", "synthesize_quilt"]
