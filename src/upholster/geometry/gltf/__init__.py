"""glTF's document and its arrays.

- `gltf`: document and buffers of a glTF file; `accessors`: its arrays; `colors`: colours of vertices
- `draco`, `meshopt`: compressed geometry
"""
