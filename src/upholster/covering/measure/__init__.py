"""Measures of a synthesis: seams, scale, fidelity to the exemplar (docs/measures.md).

- `report`: all measures of a result; `measure_rows`: rows of its table
- `samples`, `places`: the data and the places that measures work on
- `seams`, `mesh_seams`, `crossings`: whether seams between charts show
- `cuts`, `source_cuts`: whether borders of blocks show; `faults`, `joint_ends`: bricks and joints cut there
- `scale`, `mapping`: the sizes and directions of the texture
- `fidelity`, `patch_distance`: whether the result looks like its exemplar
- `trace`: the placement of each texel
"""

from upholster.covering.measure.cuts import cut_seam_ratio, matched_cut_ratio
from upholster.covering.measure.faults import BrokenElements, broken_elements
from upholster.covering.measure.fidelity import sliced_wasserstein
from upholster.covering.measure.joint_ends import JointEnds, joint_ends
from upholster.covering.measure.mapping import MappingReport, mapping, mesh_mapping
from upholster.covering.measure.mesh_seams import MeshSeams, mesh_seams
from upholster.covering.measure.patch_distance import PatchDistance, patch_distance, undistorted_views
from upholster.covering.measure.report import Measures, Seams, measure_cover, measure_image
from upholster.covering.measure.scale import TexelScale, texel_scale
from upholster.covering.measure.seams import WrapSeams, edge_seam_ratio, wrap_seams

__all__ = [
    "BrokenElements",
    "JointEnds",
    "MappingReport",
    "Measures",
    "MeshSeams",
    "PatchDistance",
    "Seams",
    "TexelScale",
    "WrapSeams",
    "broken_elements",
    "cut_seam_ratio",
    "edge_seam_ratio",
    "joint_ends",
    "mapping",
    "matched_cut_ratio",
    "measure_cover",
    "measure_image",
    "mesh_mapping",
    "mesh_seams",
    "patch_distance",
    "sliced_wasserstein",
    "texel_scale",
    "undistorted_views",
    "wrap_seams",
]
