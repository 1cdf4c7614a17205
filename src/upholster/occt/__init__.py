"""CAD files read by Open CASCADE, in a process of its own: it may crash, hang, or fill the memory.

- `records`: what the process tells: bodies, faces, their surfaces and triangles, as plain arrays
- `process`: starts it, with limits of time and memory, and reads what it tells
- `__main__`: the process itself; all below run in it alone
- `shape_reading`: STEP, IGES and BREP as shapes with names, colours and layers; `rhino`: 3DM
- `bodies`: shapes as bodies, each shape once; `face_surfaces`: what a face lies on; `meshing`: its triangles

Only the modules that run in the process import OCP and rhino3dm.
"""
