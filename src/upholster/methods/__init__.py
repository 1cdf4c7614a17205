"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

`synthesis` settles layout, scale and direction and calls a method: `paper`, `pixel` or `quilt`.
"""

from upholster.methods.synthesis import (
    Prepared,
    asked_files,
    coarser,
    execute,
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
    "Prepared",
    "asked_files",
    "coarser",
    "execute",
    "kept_sample",
    "lay_plan",
    "matched_image",
    "needs_patches",
    "prepare",
    "sample_width",
    "settled_seed",
    "synthesize",
]
