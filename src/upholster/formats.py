"""All kinds of files by their names: what is written, and which models are read.

An output is a record here, and a writer in `upholster.outputs`; all else reads the records. Nothing heavy is
imported here, for ``upholster --help``.
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
"""What `upholster.occt` reads."""

MODEL_SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".off", *CAD_SUFFIXES)
"""What `upholster.geometry.mesh_files` reads."""

PROJECT_SUFFIX = ".upholster.json"

UDIM = "<UDIM>"
"""What stands in a file's name for the number of a tile."""


def is_model_name(name: str) -> bool:
    """Return whether a file is a model by its name."""
    return name.lower().endswith(MODEL_SUFFIXES)


@dataclass(frozen=True, slots=True)
class OutputKind:
    """A kind of output: by which names it is asked for, of which files it consists, and what it holds.

    Attributes
    ----------
    words
        What it is, for the help.
    suffixes
        In lower case.
    kernels
        Which it needs, see ``USES`` of `benchmarks.kernel_table`: model, texels, stream or picture.
    prefix
        What stands before the path.
    only
        Where alone such names mean it: of a flat texture, or where triangles are displaced.
    beside
        How the names of files beside it go on after its stem.
    texture
        Likewise, of the base colour's file; '' where it is that file itself, None where it has none.
    atlas, tiles
        Whether it holds an atlas, which may have several pages; whether these may be tiles of UDIM.
    stream, solid
        Whether it holds a stream, of one sample; or triangles alone, which may be displaced.
    lods
        Whether further files with smaller textures can go with it.
    mesh
        Whether it shows what only meshes have.
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
STL = OutputKind("triangles alone", (".stl",), solid=True)
THREE_MF = OutputKind("triangles alone", (".3mf",), solid=True)
SOLID_OBJ = OutputKind("likewise with `--displace`", (".obj",), only="displaced", solid=True)
SOLID_PLY = OutputKind("likewise with `--displace`", (".ply",), only="displaced", solid=True)
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
"""All kinds, in the order of the help; of those that fit a name the last is meant."""


def split_name(text: str) -> tuple[str, str]:
    """Return which prefix a name has, or means, and its path: with ``<UDIM>`` an image is an atlas."""
    prefix = next((kind.prefix for kind in OUTPUTS if kind.prefix and text.startswith(kind.prefix)), "")
    place = text.removeprefix(prefix)
    path = Path(place)
    if not prefix and path.suffix.lower() in _IMAGES:
        prefix = ATLAS.prefix if UDIM in path.name else DIRECTIONS.prefix * (path.stem == "directions")
    return prefix, place


def kind_of(prefix: str, path: str, only: Collection[str] = ()) -> OutputKind | None:
    """Return which kind a name means, as `split_name` splits it; `only` are those of a kind that hold."""
    meant = (kind for kind in reversed(OUTPUTS) if kind.prefix == prefix and kind.only in ("", *only))
    return next((kind for kind in meant if Path(path).suffix.lower() in kind.suffixes), None)


def suffixes_of(kinds: Iterable[OutputKind]) -> list[str]:
    """Return the suffixes of some kinds, each once."""
    return list(dict.fromkeys(suffix for kind in kinds for suffix in kind.suffixes))


def outputs_in_words() -> str:
    """Return for the help what is written, by suffix."""
    by_words: dict[str, list[OutputKind]] = {}
    for kind in OUTPUTS:
        by_words.setdefault(kind.words, []).append(kind)
    told: dict[str, list[str]] = {}
    for words, kinds in by_words.items():
        told.setdefault(" ".join(suffixes_of(kinds)), []).append(words)
    return ", ".join(f"{suffixes} ({'; '.join(words)})" for suffixes, words in told.items())
