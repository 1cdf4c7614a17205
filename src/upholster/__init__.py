"""Cover curved surfaces with texture from a small sample image.

>>> import upholster
>>> exemplar = upholster.read_exemplar("brick.png")
>>> surface = upholster.ring_cyclide(6, 2, 3)
>>> quilt = upholster.synthesize(exemplar, surface, seed=7)
>>> texels = upholster.paint(quilt, exemplar)
>>> upholster.write("ring.glb", surface, texels)
"""

import importlib
from typing import TYPE_CHECKING, Any

from upholster._version import __version__
from upholster.errors import FormatError, InputError, UpholsterError

if TYPE_CHECKING:
    from upholster import measure
    from upholster.coverings.synthesis import synthesize
    from upholster.filling import fill
    from upholster.geometry import (
        RationalPatch,
        Surface,
        plane,
        revolve,
        ring_cyclide,
        sphere,
        surface_from_spec,
        torus,
    )
    from upholster.image import Material, read_exemplar, read_material
    from upholster.limits import Limits
    from upholster.notebook import view
    from upholster.options import ModelOptions, SynthesisOptions, WriteOptions
    from upholster.pipeline import cover, refine, write
    from upholster.quilt import Quilt, Texels, paint, paint_material
    from upholster.stream import StreamDecoder, encode_stream

__all__ = [
    "FormatError",
    "InputError",
    "Limits",
    "Material",
    "ModelOptions",
    "Project",
    "Quilt",
    "RationalPatch",
    "Sample",
    "SampleOptions",
    "StreamDecoder",
    "Surface",
    "SynthesisOptions",
    "Texels",
    "UpholsterError",
    "WriteOptions",
    "__version__",
    "cover",
    "encode_stream",
    "fill",
    "measure",
    "paint",
    "paint_material",
    "plane",
    "read_exemplar",
    "read_material",
    "read_project",
    "refine",
    "revolve",
    "ring_cyclide",
    "save_project",
    "sphere",
    "surface_from_spec",
    "synthesize",
    "torus",
    "view",
    "write",
]

_HOMES = {
    "upholster.filling": ("fill",),
    "upholster.geometry": (
        "RationalPatch",
        "Surface",
        "plane",
        "revolve",
        "ring_cyclide",
        "sphere",
        "surface_from_spec",
        "torus",
    ),
    "upholster.image": ("Material", "read_exemplar", "read_material"),
    "upholster.image.source": ("Sample",),
    "upholster.limits": ("Limits",),
    "upholster.options": ("ModelOptions", "SampleOptions", "SynthesisOptions", "WriteOptions"),
    "upholster.pipeline": ("cover", "refine", "write"),
    "upholster.project": ("Project", "read_project", "save_project"),
    "upholster.stream": ("StreamDecoder", "encode_stream"),
    "upholster.quilt": ("Quilt", "Texels", "paint", "paint_material"),
    "upholster.coverings.synthesis": ("synthesize",),
    "upholster.notebook": ("view",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    # Loaded at first use: `upholster --help` must not wait for NumPy and Numba.
    if name == "measure":
        return importlib.import_module("upholster.measure")
    if name not in _HOME:
        raise AttributeError(f"module 'upholster' has no attribute {name!r}")
    importlib.import_module("upholster.notebook")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
