"""Charts over a surface: where they lie, how large they are, where they meet, which way the texture runs.

`layout` cuts a surface of patches into charts (`halving` finds the cuts), `chart_seams` finds where they
meet; `unwrap` lays meshes out flat, in islands. `charted` makes one kind of surface of all, triangles on
charts (of patches by `tessellation`), on which all else works: `directions`, `turns` and `mesh_warp_fields`
say which way the texture runs, `phases` where samples that repeat are in their periods, `subdivision` makes
triangles short.
"""

from upholster.charts.layout import uniform_layout

__all__ = ["uniform_layout"]
