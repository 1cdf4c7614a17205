"""The embedded zerotree codec: images to bytes, any prefix of which decodes; and the stream of a surface.

- `stream`: textured surfaces; `ezw`: image files
- `image_code`: images to header and stream; `header`: the first bytes
- `color_transforms`: colour to planes
- `coder`: coefficients to bytes; `tree`: their order in memory; `tables`: tables that both sides share
- `thresholds`: passes of the paper's profile; `partial_image`: an image from some of its coefficients
- `lifting`: wavelet transforms for coding; `haar`: the paper's
"""
