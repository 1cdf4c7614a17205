"""Pictures of a textured model, without a display or a GPU.

- `picture`: draws a model, seen by a `camera`; `checks`: its inputs
- `texture`, `material_maps`: texture and maps prepared for look-up
- `light`: light on a texture alone; `environment`: light on materials
- `directions`: pictures of direction fields
"""
