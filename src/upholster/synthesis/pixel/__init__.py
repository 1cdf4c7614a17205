"""Method "pixel": every texel is chosen separately, by its neighbourhood, from coarse to fine.

This is the baseline that the paper compares itself with. `method` has the steps, `exemplar_levels` the data
by which a sample's pixels are compared, `surface_levels` the texels on each level and across their charts'
edges.
"""
