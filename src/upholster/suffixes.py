"""Names of models' files by their endings; nothing heavy is imported here, for ``upholster --help``."""

__all__ = ["CAD_SUFFIXES", "MODEL_SUFFIXES", "PROJECT_SUFFIX", "is_model_name"]

CAD_SUFFIXES = (".step", ".stp", ".iges", ".igs", ".brep", ".brp", ".3dm")
"""What `upholster.occt` reads."""

MODEL_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".off", *CAD_SUFFIXES)
"""What `upholster.geometry.mesh_files` reads."""


PROJECT_SUFFIX = ".upholster.json"


def is_model_name(name: str) -> bool:
    """Return whether a file is a model by its name."""
    return name.lower().endswith(MODEL_SUFFIXES)
