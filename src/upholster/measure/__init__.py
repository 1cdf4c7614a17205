"""Measures of a synthesis: seams, scale, fidelity to the exemplar (docs/measures.md).

- `report`: all measures of a result; `samples`, `places`: the data and the places that they work on
- `seams`, `mesh_seams`, `crossings`: whether seams between charts show
- `cuts`, `source_cuts`: whether borders of blocks show; `broken`, `joint_ends`: bricks and joints cut there
- `scale`, `mapping`: the sizes and directions of the texture
- `fidelity`, `patch_distance`: whether the result looks like its exemplar
- `trace`: the placement of each texel
"""

from upholster.measure.broken import BrokenElements, broken_elements
from upholster.measure.cuts import cut_seam_ratio, matched_cut_ratio
from upholster.measure.fidelity import sliced_wasserstein
from upholster.measure.joint_ends import JointEnds, joint_ends
from upholster.measure.mapping import MappingReport, mapping, mesh_mapping
from upholster.measure.mesh_seams import MeshSeams, mesh_seams
from upholster.measure.patch_distance import PatchDistance, patch_distance, undistorted_views
from upholster.measure.report import Measures, Seams, measure_cover, measure_image
from upholster.measure.scale import TexelScale, texel_scale
from upholster.measure.seams import WrapSeams, edge_seam_ratio, wrap_seams

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
