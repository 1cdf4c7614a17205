"""The embedded zerotree codec: images to bytes, any prefix of which decodes.

- `ezw`: image files; `image_code`: images to header and stream; `header`: the first bytes
- `color_transforms`: colour to planes
- `coder`: coefficients to bytes; `tree`: their order in memory; `tables`: tables that both sides share
- `thresholds`: passes of the paper's profile; `partial_image`: an image from some of its coefficients
"""

from upholster.codec.ezw import DecodedImage, decode, encode
from upholster.codec.header import MAX_SAMPLES, ImageHeader
from upholster.codec.image_code import CodedImage, check_image, encode_parts
from upholster.codec.partial_image import ImageDecoder

__all__ = [
    "MAX_SAMPLES",
    "CodedImage",
    "DecodedImage",
    "ImageDecoder",
    "ImageHeader",
    "check_image",
    "decode",
    "encode",
    "encode_parts",
]
