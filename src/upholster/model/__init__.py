"""The textured model: atlas and texture coordinates."""

from upholster.model.atlas import Atlas, Cell, build_atlas

__all__ = ["Atlas", "Cell", "build_atlas"]
