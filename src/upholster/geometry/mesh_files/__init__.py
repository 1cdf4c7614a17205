"""Models as people have them: GLB, glTF, OBJ, PLY, STL, OFF and CAD files read as triangle meshes.

- `reading`: `read_model`, whatever the format; `model_file`: what it gives, parts and their names
- `gltf`: document and buffers of a glTF file; `accessors`: arrays of them; `gltf_scene`: its meshes in place
- `draco`, `meshopt`: compressed geometry
- `obj`, `ply`, `stl`, `off`: the other formats, each a `RawModel`; `text_numbers`: numbers in text
- `cad_model`: CAD files, which `upholster.occt` reads; `units`: those that a user can tell
- `colors`: colours of vertices
- `polygons`: quadrilaterals and polygons as triangles
"""

from upholster.geometry.mesh_files.model_file import GltfPart, ModelFile, ModelPart
from upholster.geometry.mesh_files.reading import read_model

__all__ = ["GltfPart", "ModelFile", "ModelPart", "read_model"]
