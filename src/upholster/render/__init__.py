"""Pictures of a textured model, without a display or a GPU."""
