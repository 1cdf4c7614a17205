"""Pictures of a textured model, without a display or a GPU.

- `picture`: draws a model, seen by a `camera`; `checks`: its inputs
- `texture`, `material_maps`: texture and maps prepared for look-up
- `light`: light on a texture alone; `environment`: light on materials
- `directions`: pictures of direction fields
"""

from upholster.render.camera import Camera
from upholster.render.picture import STUDIO_BACKGROUND, render

__all__ = ["STUDIO_BACKGROUND", "Camera", "render"]
