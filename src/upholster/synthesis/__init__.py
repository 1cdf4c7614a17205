"""Texture synthesis: from an exemplar and a layout of charts to a quilt, and from a quilt to texels."""
