"""Surfaces of rational Bézier patches.

- `patch`: one rational Bézier patch; `bernstein`: its polynomials; `normals`: its normals, poles included
- `face`: a grid of patches; `face_assembly`: patches to faces; `surface`: faces and how their edges meet
- `edges`, `overlaps`, `adjacency`, `face_seams`: which edges of patches meet, and where
- `orientation`: normals outward; `same_edges`: whether two surfaces are connected in the same way
"""
