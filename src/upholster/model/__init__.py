"""The textured model: mesh, tangents, atlas and texture coordinates; solids; and pictures.

- `textured_model`: a surface with its texels, and everything made of them; `composite`: several on one mesh
- `atlas`: all charts in one image; `packing`, `islands`: their places in it; `gutter`: their gutters
- `island_cuts`: islands in pieces, if they are larger than a page
- `normal_atlas`: the atlas of a normal map; `tangents`: the frame of its vectors
- `mesh_on_charts`: a mesh with places on its charts
- `displaced_mesh`: the displaced mesh; `heights`: its heights; `folds`: finding and undoing its folds
- `solid`: whether triangles can be printed
- `render`: pictures
"""
