"""The type of both kinds of surfaces."""

from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface

__all__ = ["AnySurface"]

AnySurface = Surface | MeshSurface
"""Surfaces that charts can be on: faces of patches, or a mesh's islands."""
