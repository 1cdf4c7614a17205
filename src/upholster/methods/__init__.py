"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

- `synthesis`: `synthesize`, and the checks and samples that come first
- `set_up`: layout, scale and direction on a surface; `seen`: the samples that are matched there
- `prepared`: the result, a prepared synthesis, and its execution by a method: `paper`, `pixel` or `quilt`
- `guidance`: guides, zones, regions and pieces that the user placed; `guided` reads them from texts
- `holes`: blocks that fill holes in a photo; `working_form`: samples in the form that methods compare
"""

from upholster.methods.guidance import Guidance
from upholster.methods.guided import given_guidance, guidance_files, read_guidance, sized_sample, with_names
from upholster.methods.prepared import Prepared, coarser, execute, holding, lay_plan
from upholster.methods.set_up import asked_files, prepare, sample_width
from upholster.methods.synthesis import kept_sample, matched_image, needs_patches, settled_seed, synthesize

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
