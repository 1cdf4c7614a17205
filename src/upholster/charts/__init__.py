"""Charts over a surface: their layout, their sizes, where they meet, and the texture's direction on them.

`layout` cuts a surface of patches into charts (`halving` finds the cuts), `chart_seams` finds where charts
meet, and `unwrap` flattens meshes into islands. `charted` turns every kind of surface into triangles on
charts (with `tessellation` for patches); all other modules work on these. `directions`, `turns` and
`mesh_warp_fields` set the texture's direction, `phases` aligns the periods of repeating samples, and
`subdivision` shortens edges.
"""

from upholster.charts.layout import uniform_layout

__all__ = ["uniform_layout"]
