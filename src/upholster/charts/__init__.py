"""Charts over a surface: where they lie, how large they are, where they meet, in which order they are laid.

`layout` cuts the surface into charts (`halving` finds the cuts), `seams` finds where they meet and the
transitions between them, `schedule` orders them, `directions` gives them their warp fields. `unwrap` lays
meshes out flat, in islands.
"""

from upholster.charts.layout import uniform_layout

__all__ = ["uniform_layout"]
