"""Writing models and images to files."""

from upholster.export.glb import TextureFormat, write_glb
from upholster.export.npz import write_npz
from upholster.export.obj import obj_companions, write_obj

__all__ = ["TextureFormat", "obj_companions", "write_glb", "write_npz", "write_obj"]
