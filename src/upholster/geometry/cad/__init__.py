"""CAD models: faces as exact grids of rational Bézier patches, with their triangles placed on them.

- `spans`: splines and arcs as rational Bézier segments
- `exact_face`: `ExactFace`, a face's patches, and the file's parameters on them
- `exact_body`: a body's vertices on the patches, normals and areas
- `slivers`: repairs triangles that are almost degenerate
"""
