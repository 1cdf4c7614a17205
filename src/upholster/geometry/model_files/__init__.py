"""Model files: GLB, glTF, OBJ, PLY, STL, OFF, 3MF and CAD files read as triangle meshes.

- `model_reader`: `read_model`, for all formats; `model_file`: its result, parts and their names
- `gltf_scene`: the meshes of a glTF file in the scene; `gltf_nodes`: their placements, and poses of skins
- `obj`, `ply`, `stl`, `off`: the other formats, `text_numbers`: numbers in text; `raw_model`: their result
- `three_mf`: 3MF packages as scenes; `three_mf_model`: their XML; `three_mf_properties`: materials, colours,
  texture coordinates; `three_mf_settings`: names by slicers; `xml_reader`: XML with limits
- `cad_model`: CAD files, which `upholster.geometry.occt` reads; `units`: units that a user can name
- `polygons`: quadrilaterals and polygons as triangles; `faces`: those of a file, in its order
"""
