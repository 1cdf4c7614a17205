"""All options: name, default, meaning and range of each, defined once for library and command line.

One module for each kind of options: `sample_options`, `model_options`, `synthesis_options`, `write_options`.
`option_fields` has what all fields share, `choices` makes options from names and values, `direction_words`
lists the words for directions. Nothing heavy is imported here: ``upholster --help`` is generated from these
fields.
"""

from upholster.options.choices import Options, chosen, settled_options, settled_seed
from upholster.options.direction_words import AXIS_DIRECTIONS, DIRECTIONS, FIELD_DIRECTIONS, PATCH_DIRECTIONS
from upholster.options.model_options import ModelOptions
from upholster.options.option_fields import METHODS, differing
from upholster.options.sample_options import PREPARING, SampleOptions
from upholster.options.synthesis_options import SynthesisOptions
from upholster.options.write_options import QUALITY, Quality, TextureFormat, WriteOptions, check_quality

__all__ = [
    "AXIS_DIRECTIONS",
    "DIRECTIONS",
    "FIELD_DIRECTIONS",
    "METHODS",
    "PATCH_DIRECTIONS",
    "PREPARING",
    "QUALITY",
    "ModelOptions",
    "Options",
    "Quality",
    "SampleOptions",
    "SynthesisOptions",
    "TextureFormat",
    "WriteOptions",
    "check_quality",
    "chosen",
    "differing",
    "settled_options",
    "settled_seed",
]
