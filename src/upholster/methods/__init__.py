"""The methods of synthesis: from an exemplar and a layout of charts to a quilt.

- `exemplar`: what is matched, and what the user asks of places: guides, zones, regions and pieces; `guided`
  reads them from texts, `guidance` moves them onto charts
- `settling`: what a request means on its surface; `fitting`: sizes that fit it
- `set_up`: the scene of a surface: layout, scale, direction; `patch_scene`: that of "paper" and "pixel"
- `execution`: the quilt of a scene, by a method: `paper`, `pixel` or `quilt`
- `holes`: blocks that fill holes in a photo; `working_form`: samples in the form that methods compare
"""

from upholster.methods.execution import execute
from upholster.methods.exemplar import Exemplar, Guidance
from upholster.methods.guided import given_guidance, guidance_files, read_guidance, sized_sample, with_names
from upholster.methods.patch_scene import PatchScene
from upholster.methods.quilt.method import lay_plan
from upholster.methods.quilt.scene import Scene, coarser, holding
from upholster.methods.set_up import asked_files, prepare, sample_width
from upholster.methods.settling import Settled, kept_sample, matched_image, needs_patches, settled

__all__ = [
    "Exemplar",
    "Guidance",
    "PatchScene",
    "Scene",
    "Settled",
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
    "settled",
    "sized_sample",
    "with_names",
]
