"""The textured model: atlas and texture coordinates."""

from upholster.model.atlas import Atlas, Cell, build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.pieces import chart_pieces

__all__ = ["Atlas", "Cell", "build_atlas", "build_normal_atlas", "chart_pieces"]
