"""Reading CAD files with Open CASCADE in a separate process, because it may crash, hang, or fill the memory.

- `records`: the process's result: bodies, faces, their surfaces and triangles, as plain arrays
- `process`: starts it, with limits of time and memory, and reads its result
- `__main__`: the process itself; only it runs the modules below
- `shape_reader`: STEP, IGES and BREP as shapes with names, colours and layers; `rhino`: 3DM
- `named_files`: the other files that a STEP assembly names
- `bodies`: shapes as bodies, each shape once; `face_surfaces`: the surface of a face; `shape_mesh`: its
  triangles

Only the modules that run in the process import OCP and rhino3dm.
"""
