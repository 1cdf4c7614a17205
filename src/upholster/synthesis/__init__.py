"""Texture synthesis: from an exemplar and a layout of charts to a quilt, and from a quilt to texels."""

from upholster.synthesis.layout import uniform_layout
from upholster.synthesis.materials import paint_material
from upholster.synthesis.methods import METHODS, Plan, carry_out, matched_image, plan, synthesize
from upholster.synthesis.normals import paint_normals
from upholster.synthesis.painting import paint
from upholster.synthesis.paper import PaperOptions, synthesize_paper
from upholster.synthesis.quilt import Chart, Quilt, Texels

__all__ = [
    "METHODS",
    "Chart",
    "PaperOptions",
    "Plan",
    "Quilt",
    "Texels",
    "carry_out",
    "matched_image",
    "paint",
    "paint_material",
    "paint_normals",
    "plan",
    "synthesize",
    "synthesize_paper",
    "uniform_layout",
]
