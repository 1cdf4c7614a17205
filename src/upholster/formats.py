"""All kinds of files by their names: outputs, and models that can be read.

An output is a record here, and a writer in `upholster.outputs`; all other code reads the records. Nothing
heavy is imported here, for ``upholster --help``.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

__all__ = [
    "CAD_SUFFIXES",
    "MODEL_SUFFIXES",
    "OUTPUTS",
    "PROJECT_SUFFIX",
    "UDIM",
    "OutputKind",
    "is_model_name",
    "kind_of",
    "outputs_in_words",
    "split_name",
    "suffixes_of",
]

CAD_SUFFIXES = (".step", ".stp", ".iges", ".igs", ".brep", ".brp", ".3dm")
"""Files that `upholster.occt` reads."""

MODEL_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".off", *CAD_SUFFIXES)
"""Files that `upholster.geometry.mesh_files` reads."""

PROJECT_SUFFIX = ".upholster.json"

UDIM = "<UDIM>"
"""The placeholder in a file's name for the number of a tile."""


def is_model_name(name: str) -> bool:
    """Return whether a file's name is that of a model."""
    return name.lower().endswith(MODEL_SUFFIXES)


@dataclass(frozen=True, slots=True)
class OutputKind:
    """A kind of output: its names, its files, and their contents.

    Attributes
    ----------
    words
        Its description for the help.
    suffixes
        In lower case.
    kernels
        The kernels that it needs, see ``USES`` of `benchmarks.kernel_table`: model, texels, stream or
        picture.
    prefix
        The prefix of the path.
    only
        The only case in which such names mean it: for a flat texture, or if triangles are displaced.
    beside
        Endings of the names of its other files, after the stem.
    texture
        Ending of the base colour's file; '' if it is the file itself, None if it has none.
    atlas, tiles
        Whether it holds an atlas, which may have several pages; whether these may be tiles of UDIM.
    stream, solid
        Whether it holds a stream, of one sample; or only triangles, which may be displaced.
    lods
        Whether further files with smaller textures can be written with it.
    mesh
        Whether it shows data that only meshes have.
    """

    words: str
    suffixes: tuple[str, ...]
    kernels: str = "model"
    prefix: str = ""
    only: Literal["", "flat", "displaced"] = ""
    beside: tuple[str, ...] = ()
    texture: str | None = None
    atlas: bool = False
    tiles: bool = False
    stream: bool = False
    solid: bool = False
    lods: bool = False
    mesh: bool = False

    @property
    def pages(self) -> bool:
        """Whether the pages of its atlas are files of their own."""
        return self.atlas and self.texture is not None


_IMAGES = (".png", ".jpg", ".jpeg", ".webp", ".exr")

GLB = OutputKind("models", (".glb",), atlas=True, lods=True)
USDZ = OutputKind("models", (".usdz",), atlas=True)
OBJ = OutputKind("models", (".obj",), beside=(".mtl",), texture="_texture.png", atlas=True)
PLY = OutputKind("models", (".ply",), texture="_texture.png", atlas=True)
NPZ = OutputKind("texels", (".npz",), "texels")
STREAM = OutputKind("progressive stream", (".uph",), "stream", stream=True)
PAGE = OutputKind("stream and viewer in one file", (".html",), "stream", stream=True)
STL = OutputKind("only triangles", (".stl",), solid=True)
THREE_MF = OutputKind("only triangles", (".3mf",), solid=True)
SOLID_OBJ = OutputKind("the same with `--displace`", (".obj",), only="displaced", solid=True)
SOLID_PLY = OutputKind("the same with `--displace`", (".ply",), only="displaced", solid=True)
PICTURE = OutputKind("a picture of the model", _IMAGES, "picture")
FLAT = OutputKind("with `--texels WxH` the flat texture", _IMAGES, "picture", only="flat", texture="")
ATLAS = OutputKind(
    "as `atlas:NAME` its texture", _IMAGES, "picture", "atlas:", texture="", atlas=True, tiles=True
)
DIRECTIONS = OutputKind(
    "as `directions:NAME` the directions on a mesh", _IMAGES[:-1], "picture", "directions:", mesh=True
)

OUTPUTS = (
    *(GLB, USDZ, OBJ, PLY, NPZ, STREAM, PAGE, STL, THREE_MF, SOLID_OBJ, SOLID_PLY),
    *(PICTURE, FLAT, ATLAS, DIRECTIONS),
)
"""All kinds, in the order of the help; if several fit a name, the last one is meant."""


def split_name(text: str) -> tuple[str, str]:
    """Return the prefix that a name has, or implies, and its path: an image with ``<UDIM>`` is an atlas."""
    prefix = next((kind.prefix for kind in OUTPUTS if kind.prefix and text.startswith(kind.prefix)), "")
    place = text.removeprefix(prefix)
    path = Path(place)
    if not prefix and path.suffix.lower() in _IMAGES:
        prefix = ATLAS.prefix if UDIM in path.name else DIRECTIONS.prefix * (path.stem == "directions")
    return prefix, place


def kind_of(prefix: str, path: str, only: Collection[str] = ()) -> OutputKind | None:
    """Return the kind that a name means, as split by `split_name`; `only` lists the special cases."""
    meant = (kind for kind in reversed(OUTPUTS) if kind.prefix == prefix and kind.only in ("", *only))
    return next((kind for kind in meant if Path(path).suffix.lower() in kind.suffixes), None)


def suffixes_of(kinds: Iterable[OutputKind]) -> list[str]:
    """Return the suffixes of some kinds, each once."""
    return list(dict.fromkeys(suffix for kind in kinds for suffix in kind.suffixes))


def outputs_in_words() -> str:
    """Return the kinds of outputs, by suffix, for the help."""
    by_words: dict[str, list[OutputKind]] = {}
    for kind in OUTPUTS:
        by_words.setdefault(kind.words, []).append(kind)
    by_suffix: dict[str, list[str]] = {}
    for words, kinds in by_words.items():
        by_suffix.setdefault(" ".join(suffixes_of(kinds)), []).append(words)
    return ", ".join(f"{suffixes} ({'; '.join(words)})" for suffixes, words in by_suffix.items())
