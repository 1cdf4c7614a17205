"""The quilt, with everything that a decoder needs: charts, placements, warp fields, and painting.

`model` has the data types; `placement` and `labels` define what shows where; `warp_field` has the 2×2
matrices over a chart; `painting`, `normal_painting` and `materials` turn a quilt and an exemplar into texels.
"""

from upholster.quilt.chart import Chart
from upholster.quilt.materials import paint_material
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.normal_painting import paint_normals
from upholster.quilt.painting import paint

__all__ = ["Chart", "Quilt", "Texels", "paint", "paint_material", "paint_normals"]
