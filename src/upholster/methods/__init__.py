"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

- `synthesis`: `synthesize`; `settling`: what a request means on its surface; `fitting`: sizes that fit it
- `set_up`: layout, scale and direction on a surface; `seen`: the samples that are matched there
- `prepared`: the result, a prepared synthesis, and its execution by a method: `paper`, `pixel` or `quilt`
- `guidance`: guides, zones, regions and pieces that the user placed; `guided` reads them from texts
- `holes`: blocks that fill holes in a photo; `working_form`: samples in the form that methods compare
"""

from upholster.methods.guidance import Guidance
from upholster.methods.guided import given_guidance, guidance_files, read_guidance, sized_sample, with_names
from upholster.methods.prepared import Prepared, coarser, execute, holding, lay_plan
from upholster.methods.set_up import asked_files, prepare, sample_width
from upholster.methods.settling import (
    Settled,
    covered_by_method,
    kept_sample,
    matched_image,
    needs_patches,
    settled,
)
from upholster.methods.synthesis import settled_seed, synthesize

__all__ = [
    "Guidance",
    "Prepared",
    "Settled",
    "asked_files",
    "coarser",
    "covered_by_method",
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
    "settled",
    "settled_seed",
    "sized_sample",
    "synthesize",
    "with_names",
]
