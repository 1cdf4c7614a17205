"""Texture synthesis: from an exemplar and a layout of charts to a quilt, and from a quilt to texels."""

from upholster.synthesis.layout import uniform_layout
from upholster.synthesis.methods import METHODS, synthesize
from upholster.synthesis.painting import paint
from upholster.synthesis.paper import PaperOptions, synthesize_paper
from upholster.synthesis.quilt import Chart, Quilt, Texels

__all__ = [
    "METHODS",
    "Chart",
    "PaperOptions",
    "Quilt",
    "Texels",
    "paint",
    "synthesize",
    "synthesize_paper",
    "uniform_layout",
]
