"""Method "pixel": every texel on its own, by its neighbourhood, from coarse to fine.

This is what the paper compares itself with. `method` has the steps, `exemplar_levels` what a sample's pixels
are compared by, `surface_levels` the texels on each level and what lies beyond their charts' edges.
"""

from upholster.methods.pixel.method import PixelOptions, synthesize_pixel

__all__ = ["PixelOptions", "synthesize_pixel"]
