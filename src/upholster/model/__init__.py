"""The textured model: atlas and texture coordinates."""
