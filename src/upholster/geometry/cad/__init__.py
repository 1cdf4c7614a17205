"""CAD models: faces as grids of rational Bézier patches, exactly, and their triangles put on them.

- `spans`: splines and arcs as rational Bézier segments
- `exact_face`: `ExactFace`, a face's patches, and its own parameters on them
- `exact_body`: a body's vertices on the patches, normals and areas
- `slivers`: triangles that are all but lines are mended
"""

from upholster.geometry.cad.exact_body import ExactBody, exact_body
from upholster.geometry.cad.exact_face import ExactFace, exact_face

__all__ = ["ExactBody", "ExactFace", "exact_body", "exact_face"]
