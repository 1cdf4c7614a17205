"""Edges of a mesh over which directions start anew."""

__all__ = ["CREASE"]

CREASE = 75.0
"""Degrees: over edges that bend more directions start anew, so that each side of a box runs straight.
Models of few triangles bend less at edges that stand for something smooth."""
