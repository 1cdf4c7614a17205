"""Images: reading and writing files, colour, resizing.

- `read`, `write`: image files; `decoding`, `heif`: their pixels; `native`: faults of the C libraries
- `stated`: what files say of themselves, and what is done with it; `jpeg`: a JPEG's base image
- `profiles`, `icc`: colour profiles to sRGB; `color`: sRGB and linear light; `numbers`: maps without colours
- `source`: the exemplar in all forms that users pass
- `material`: a material; `material_files`, `packages`: its files, in folders and zip files; `roles`: its maps
- `normal_convention`: OpenGL or DirectX; `masks`: which pixels of a sample are used
- `preparing`: from a photo to a sample: `rectify`, `perspective`, `even_light`, `resize`
- `sameness`: whether a sample is one texture; `combined`: several samples in one image
- `blending`: pieces copied without an edge; `drawing`: text and lines on pictures
"""

from upholster.image.color import alpha_channel, from_linear, to_linear
from upholster.image.material import Material
from upholster.image.material_files import read_material
from upholster.image.read import check_exemplar, read_exemplar, read_image
from upholster.image.resize import resize_image
from upholster.image.write import IMAGE_SUFFIXES, ImageFormat, encode_image, write_image

__all__ = [
    "IMAGE_SUFFIXES",
    "ImageFormat",
    "Material",
    "alpha_channel",
    "check_exemplar",
    "encode_image",
    "from_linear",
    "read_exemplar",
    "read_image",
    "read_material",
    "resize_image",
    "to_linear",
    "write_image",
]
