"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

- `exemplar`: what is matched, and what the user asks of places: guides, zones, regions and pieces
- `guidance_reader`: these from texts; `guidance`: these moved onto charts
- `surface_request`: what a request means on its surface; `size_fit`: sizes that fit it
- `setup`: the scene of a surface: layout, scale, direction; `patch_scene`: that of "paper" and "pixel"
- `execution`: the quilt of a scene, by a method: `paper`, `pixel` or `quilt`
- `photo_fill`: holes in photos and materials, with the blocks of `holes`
- `working_form`: samples in the form that methods compare
"""
