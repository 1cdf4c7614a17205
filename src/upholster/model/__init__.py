"""The textured model: atlas and texture coordinates."""

from upholster.model.atlas import Atlas, AtlasCell, build_atlas
from upholster.model.normal_atlas import build_normal_atlas
from upholster.model.pieces import chart_pieces

__all__ = ["Atlas", "AtlasCell", "build_atlas", "build_normal_atlas", "chart_pieces"]
