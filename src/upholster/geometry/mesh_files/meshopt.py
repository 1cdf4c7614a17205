"""Meshopt-compressed buffer views (EXT_meshopt_compression)."""

import numpy as np
from numpy.typing import NDArray

from upholster.errors import InputError
from upholster.geometry.mesh_files.gltf import Gltf, Json

__all__ = ["MESHOPT", "decoded_view", "meshopt_of"]

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def meshopt_of(entry: Json) -> Json | None:
    """Return what a buffer view says of its compression; None where it is not compressed."""
    extensions = entry.get("extensions")
    if not isinstance(extensions, dict):
        return None
    return next((extensions[name] for name in MESHOPT if isinstance(extensions.get(name), dict)), None)


def decoded_view(gltf: Gltf, entry: Json, extension: Json) -> NDArray[np.uint8]:
    """Decompress a buffer view."""
    del gltf, entry, extension
    raise InputError("meshopt compression is not read yet")
