"""Images: pixels and what they mean. `files` reads and writes them, `photo` makes samples of photos.

- `color`: sRGB and linear light; `numbers`: maps without colours; `roles`: the maps of a material
- `profiles`, `icc`: colour profiles to sRGB; `masks`: which pixels of a sample are used
- `normal_convention`: OpenGL or DirectX; `sameness`: whether a sample is one texture
- `resize`: resampling; `blend`: pieces copied without an edge; `drawing`: text and lines on pictures
- `elements`: the structure of a sample: its waves and its joints
"""
