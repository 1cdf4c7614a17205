"""The embedded zerotree codec: images to bytes, any prefix of which decodes."""

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
