"""Orienting a surface so that its normals point outward."""

import numpy as np

from upholster.geometry.patches.surface import Surface

__all__ = ["pointing_outward", "signed_volume"]


def signed_volume(surface: Surface) -> float:
    """Return the volume that a surface encloses, in cubic units: negative if its normals point inward.

    Computed as the flux of (x − centre)/3 through the patches, with 8 × 8 Gauss points on each. For an open
    surface it is the volume of the cone from the centre of the bounding box, positive if most of the surface
    faces outward.
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)
    u, w = (nodes + 1.0) / 2.0, weights / 2.0
    centre = surface.box.mean(axis=0)
    total = 0.0
    for patch in surface.patches:
        points, along_s, along_t = patch.derivatives_grid(u, u)
        flux = np.einsum("ijk,ijk->ij", points - centre, np.cross(along_s, along_t))
        total += float(w @ flux @ w) / 3.0
    return total


def pointing_outward(surface: Surface) -> Surface:
    """Return the surface, with the columns of every patch reversed if its signed volume is negative.

    Columns are reversed rather than transposed, so that rows that run downward still do.
    """
    return surface.turned() if signed_volume(surface) < 0.0 else surface
