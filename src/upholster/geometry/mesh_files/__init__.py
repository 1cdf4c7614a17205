"""Model files: GLB, glTF, OBJ, PLY, STL, OFF, 3MF and CAD files read as triangle meshes.

- `reading`: `read_model`, for all formats; `model_file`: its result, parts and their names
- `gltf`: document and buffers of a glTF file; `accessors`: its arrays; `gltf_scene`: its meshes in the scene;
  `gltf_nodes`: their placements, and poses of skins
- `draco`, `meshopt`: compressed geometry
- `obj`, `ply`, `stl`, `off`: the other formats, `text_numbers`: numbers in text; `raw_model`: their result
- `three_mf`: 3MF packages as scenes; `three_mf_model`: their XML; `three_mf_properties`: materials, colours,
  texture coordinates; `three_mf_settings`: names by slicers; `xml_reading`: XML with limits
- `cad_model`: CAD files, which `upholster.occt` reads; `units`: units that a user can name
- `colors`: colours of vertices
- `polygons`: quadrilaterals and polygons as triangles; `faces`: those of a file, in its order
"""

from upholster.geometry.mesh_files.model_file import GltfPart, ModelFile, ModelPart
from upholster.geometry.mesh_files.reading import read_model

__all__ = ["GltfPart", "ModelFile", "ModelPart", "read_model"]
