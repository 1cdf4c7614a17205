"""Samples from files: images, materials, and everything that users pass as a sample.

- `source`: the sample in all forms that users pass; `collage`: several samples in one image
- `read`, `write`: image files; `image_decoder`, `heif`: their pixels; `native`: faults of the C libraries
- `statements`: what files say of themselves, and what is done with it; `jpeg`: a JPEG's base image
- `material`: a material; `material_files`, `packages`: its files, in folders and zip files
"""
