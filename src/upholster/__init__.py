"""Cover curved surfaces with texture from a small sample image."""
