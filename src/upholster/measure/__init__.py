"""Measures of a synthesis: seams, scale, fidelity to the exemplar, verbatim copies (docs/measures.md)."""

from upholster.measure.copies import Copies, copies
from upholster.measure.fidelity import sliced_wasserstein
from upholster.measure.report import Measures, Seams, measure_cover, measure_image
from upholster.measure.scale import TexelScale, texel_scale
from upholster.measure.seams import cut_seam_ratio, edge_seam_ratio
from upholster.measure.structure import Peak, Structure, structure

__all__ = [
    "Copies",
    "Measures",
    "Peak",
    "Seams",
    "Structure",
    "TexelScale",
    "copies",
    "cut_seam_ratio",
    "edge_seam_ratio",
    "measure_cover",
    "measure_image",
    "sliced_wasserstein",
    "structure",
    "texel_scale",
]
