"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

`synthesis` sets layout, scale and direction and calls a method: `paper`, `pixel` or `quilt`.
"""

from upholster.methods.guidance import Guidance
from upholster.methods.guided import given_guidance, guidance_files, read_guidance, sized_sample, with_names
from upholster.methods.synthesis import (
    Prepared,
    asked_files,
    coarser,
    execute,
    holding,
    kept_sample,
    lay_plan,
    matched_image,
    needs_patches,
    prepare,
    sample_width,
    settled_seed,
    synthesize,
)

__all__ = [
    "Guidance",
    "Prepared",
    "asked_files",
    "coarser",
    "execute",
    "given_guidance",
    "guidance_files",
    "holding",
    "kept_sample",
    "lay_plan",
    "matched_image",
    "needs_patches",
    "prepare",
    "read_guidance",
    "sample_width",
    "settled_seed",
    "sized_sample",
    "synthesize",
    "with_names",
]
