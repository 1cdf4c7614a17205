"""Surfaces: rational Bézier patches, and triangle meshes.

- `patches`: patches, faces, and how their edges meet; `built_in`: surfaces by name, and control nets in files
- `meshes`: triangle meshes and their islands; `any_surface`: the type of both kinds
- `components`: what is connected
- `model_files`: models in files; `gltf`: glTF's document and buffers
- `cad`: faces of CAD models; `occt`: the process that reads CAD files
"""
