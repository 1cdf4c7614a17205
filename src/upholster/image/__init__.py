"""Images: reading and writing files, colour, resizing."""

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
