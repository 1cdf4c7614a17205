"""Method "paper": blocks on every patch by the paper's rule, then edge blocks along the shared edges.

`method` has the steps, `matching` the coefficients by which blocks are compared, `strips` the shared edges,
`layers` the chosen blocks as a quilt, `coefficients` the threshold of equation 7.
"""
