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
from upholster.base.errors import FormatError, InputError, UpholsterError

if TYPE_CHECKING:
    from upholster.apps.notebook import view
    from upholster.apps.project.file import read_project, save_project
    from upholster.apps.project.project import Project
    from upholster.base.limits import Limits
    from upholster.base.options.model_options import ModelOptions
    from upholster.base.options.sample_options import SampleOptions
    from upholster.base.options.synthesis_options import SynthesisOptions
    from upholster.base.options.write_options import WriteOptions
    from upholster.codec.stream.reader import StreamDecoder
    from upholster.codec.stream.writer import encode_stream
    from upholster.covering import measure
    from upholster.covering.synthesis import synthesize
    from upholster.geometry.built_in.catalog import surface_from_spec
    from upholster.geometry.built_in.cyclide import ring_cyclide, torus
    from upholster.geometry.built_in.plane import plane
    from upholster.geometry.built_in.revolution import revolve
    from upholster.geometry.built_in.sphere import sphere
    from upholster.geometry.patches.patch import RationalPatch
    from upholster.geometry.patches.surface import Surface
    from upholster.image.files.material import Material
    from upholster.image.files.material_files import read_material
    from upholster.image.files.read import read_exemplar
    from upholster.image.files.source import Sample
    from upholster.pipeline import cover, refine, write
    from upholster.quilt.materials import paint_material
    from upholster.quilt.model import Quilt, Texels
    from upholster.quilt.painting import paint
    from upholster.synthesis.photo_fill import fill

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
    "upholster.apps.notebook": ("view",),
    "upholster.apps.project.file": (
        "read_project",
        "save_project",
    ),
    "upholster.apps.project.project": ("Project",),
    "upholster.base.limits": ("Limits",),
    "upholster.base.options.model_options": ("ModelOptions",),
    "upholster.base.options.sample_options": ("SampleOptions",),
    "upholster.base.options.synthesis_options": ("SynthesisOptions",),
    "upholster.base.options.write_options": ("WriteOptions",),
    "upholster.codec.stream.reader": ("StreamDecoder",),
    "upholster.codec.stream.writer": ("encode_stream",),
    "upholster.covering.synthesis": ("synthesize",),
    "upholster.geometry.built_in.catalog": ("surface_from_spec",),
    "upholster.geometry.built_in.cyclide": (
        "ring_cyclide",
        "torus",
    ),
    "upholster.geometry.built_in.plane": ("plane",),
    "upholster.geometry.built_in.revolution": ("revolve",),
    "upholster.geometry.built_in.sphere": ("sphere",),
    "upholster.geometry.patches.patch": ("RationalPatch",),
    "upholster.geometry.patches.surface": ("Surface",),
    "upholster.image.files.material": ("Material",),
    "upholster.image.files.material_files": ("read_material",),
    "upholster.image.files.read": ("read_exemplar",),
    "upholster.image.files.source": ("Sample",),
    "upholster.pipeline": (
        "cover",
        "refine",
        "write",
    ),
    "upholster.quilt.materials": ("paint_material",),
    "upholster.quilt.model": (
        "Quilt",
        "Texels",
    ),
    "upholster.quilt.painting": ("paint",),
    "upholster.synthesis.photo_fill": ("fill",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    # Loaded at first use: `upholster --help` must not wait for NumPy and Numba.
    if name == "measure":
        return importlib.import_module("upholster.covering.measure")
    if name not in _HOME:
        raise AttributeError(f"module 'upholster' has no attribute {name!r}")
    importlib.import_module("upholster.apps.notebook")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
