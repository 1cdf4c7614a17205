"""Pictures of a textured model, without a display or a GPU."""

from upholster.render.camera import Camera
from upholster.render.picture import STUDIO_BACKGROUND, render

__all__ = ["STUDIO_BACKGROUND", "Camera", "render"]
