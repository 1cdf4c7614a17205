"""Writing models and images to files.

- `glb`: glTF from a surface; `pbr`: its material; `gltf_edit`, `gltf_references`: changes to a document
- `glb_copy`: a copy of a glTF file with other textures; `vertex_splits`: vertices with several coordinates
- `obj`, `ply`: with texture; `bare`: without; `stl`, `three_mf`: for printing; `usdz`: from a GLB
- `pages`: a mesh with the pages of its atlas; `map_files`: a material's maps as images
- `npz`: texels as arrays; `html`: a page that shows a stream
"""
