"""All kinds of files by their names: outputs, and the files that surfaces and models are read from.

To add an output, add a row to `OUTPUTS` and a writer of its name in `upholster.output.outputs`. To add a file
that is read, add a row to `INPUTS` and a reader of its name in `upholster.geometry`. Everything else reads
the rows. This module imports nothing heavy, so ``upholster --help`` stays quick.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

__all__ = [
    "CAD_SUFFIXES",
    "IMAGES_READ",
    "IMAGES_WRITTEN",
    "INPUTS",
    "LDR_PICTURES",
    "MESH_SUFFIXES",
    "MODEL_SUFFIXES",
    "OUTPUTS",
    "PICTURES",
    "PROJECT_SUFFIX",
    "SURFACE_SUFFIXES",
    "UDIM",
    "InputKind",
    "Offer",
    "OutputKind",
    "input_kind",
    "is_model_name",
    "kind_of",
    "offered_outputs",
    "outputs_in_words",
    "split_name",
    "suffixes_of",
]

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".exr")
"""Suffixes of pictures that are written."""

LDR_PICTURES = PICTURES[:-1]
"""Those that hold sRGB-coded integers."""

IMAGES_WRITTEN = "PNG, JPEG, WebP, TIFF, EXR"
"""Formats of images that are written, in words."""

IMAGES_READ = f"{IMAGES_WRITTEN}, HEIC, AVIF"
"""Formats of images that are read, in words."""

PROJECT_SUFFIX = ".upholster.json"

UDIM = "<UDIM>"
"""The placeholder in a file's name for the number of a tile."""


@dataclass(frozen=True, slots=True)
class InputKind:
    """A kind of file that a surface is read from.

    Attributes
    ----------
    name
        What the format is called, and the key of its reader.
    suffixes
        In lower case.
    holds
        "mesh": a model of triangles, read by `upholster.geometry.model_files`. "cad": a CAD model, read there
        by way of `upholster.geometry.occt`. "patches": control nets, read by
        `upholster.geometry.built_in.surface_files`.
    """

    name: str
    suffixes: tuple[str, ...]
    holds: Literal["mesh", "cad", "patches"] = "mesh"


INPUTS = (
    InputKind("glTF", (".glb", ".gltf")),
    InputKind("OBJ", (".obj",)),
    InputKind("PLY", (".ply",)),
    InputKind("STL", (".stl",)),
    InputKind("OFF", (".off",)),
    InputKind("3MF", (".3mf",)),
    InputKind("STEP", (".step", ".stp"), "cad"),
    InputKind("IGES", (".iges", ".igs"), "cad"),
    InputKind("BREP", (".brep", ".brp"), "cad"),
    InputKind("3DM", (".3dm",), "cad"),
    InputKind("nets", (".json",), "patches"),
    InputKind("patch list", (".bpt", ".bpt.txt"), "patches"),
)
"""All kinds of files that surfaces are read from."""


def _input_suffixes(*holds: str) -> tuple[str, ...]:
    return tuple(suffix for kind in INPUTS if kind.holds in holds for suffix in kind.suffixes)


MESH_SUFFIXES = _input_suffixes("mesh")
MODEL_SUFFIXES = _input_suffixes("mesh", "cad")
CAD_SUFFIXES = _input_suffixes("cad")
SURFACE_SUFFIXES = _input_suffixes("patches")


def input_kind(name: str) -> InputKind | None:
    """Return what kind of file a name means; None if it is none that a surface is read from."""
    return next((kind for kind in INPUTS if name.lower().endswith(kind.suffixes)), None)


def is_model_name(name: str) -> bool:
    """Return whether a file's name is that of a model."""
    return name.lower().endswith(MODEL_SUFFIXES)


class Offer(NamedTuple):
    """How the studio offers an output: its name there, its purpose, and the ending of its file's name."""

    title: str
    purpose: str
    ending: str


@dataclass(frozen=True, slots=True)
class OutputKind:
    """A kind of output: its names, its files, and their contents.

    Attributes
    ----------
    name
        The key of its writer.
    words
        Its description for the help.
    suffixes
        In lower case.
    kernels
        The kernels that it needs, see ``USES`` of `benchmarks.kernel_table`: model, texels, stream or
        picture.
    prefix
        The prefix of the path.
    stem
        A file name without suffix that also means it.
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
    extra
        The extra that must be installed to write it.
    offer
        How the studio offers it; None: it does not.
    """

    name: str
    words: str
    suffixes: tuple[str, ...]
    kernels: str = "model"
    prefix: str = ""
    stem: str = ""
    only: Literal["", "flat", "displaced"] = ""
    beside: tuple[str, ...] = ()
    texture: str | None = None
    atlas: bool = False
    tiles: bool = False
    stream: bool = False
    solid: bool = False
    lods: bool = False
    mesh: bool = False
    extra: str = ""
    offer: Offer | None = None

    @property
    def pages(self) -> bool:
        """Whether the pages of its atlas are files of their own."""
        return self.atlas and self.texture is not None


OUTPUTS = (
    OutputKind(
        "glb", "models", (".glb",),
        atlas=True, lods=True, offer=Offer("GLB", "for the web, Blender, engines", ".glb"),
    ),
    OutputKind(
        "usdz", "models", (".usdz",),
        atlas=True, extra="usd", offer=Offer("USDZ", "for iPhone and iPad", ".usdz"),
    ),
    OutputKind(
        "obj", "models", (".obj",), beside=(".mtl",), texture="_texture.png",
        atlas=True, offer=Offer("OBJ", "with its texture in a file of its own", ".obj"),
    ),
    OutputKind("ply", "models", (".ply",), texture="_texture.png", atlas=True),
    OutputKind("npz", "texels", (".npz",), "texels"),
    OutputKind(
        "stream", "progressive stream", (".uph",), "stream",
        stream=True, offer=Offer("Stream", "any first part of it is a complete model", ".uph"),
    ),
    OutputKind(
        "page", "stream and viewer in one file", (".html",), "stream",
        stream=True, offer=Offer("Page", "viewer and model in one file", ".html"),
    ),
    OutputKind("stl", "only triangles", (".stl",), solid=True),
    OutputKind("3mf", "only triangles", (".3mf",), solid=True, offer=Offer("3MF", "for printers", ".3mf")),
    OutputKind("solid obj", "the same with `--displace`", (".obj",), only="displaced", solid=True),
    OutputKind("solid ply", "the same with `--displace`", (".ply",), only="displaced", solid=True),
    OutputKind(
        "picture", "a picture of the model", PICTURES, "picture",
        offer=Offer("Picture", "of the model", ".png"),
    ),
    OutputKind(
        "flat", "with `--texels WxH` the flat texture", PICTURES, "picture",
        only="flat", texture="",
    ),
    OutputKind(
        "atlas", "as `atlas:NAME` its texture", PICTURES, "picture", prefix="atlas:", texture="",
        atlas=True, tiles=True, offer=Offer("Texture", "the atlas as an image", "_texture.png"),
    ),
    OutputKind(
        "directions", "as `directions:NAME` the directions on a mesh", LDR_PICTURES, "picture",
        prefix="directions:", stem="directions", mesh=True,
    ),
)  # fmt: skip
"""All kinds, in the order of the help; if several fit a name, the last one is meant."""


def offered_outputs() -> list[dict[str, str | bool]]:
    """Return the outputs that the studio offers, as its page reads them."""
    return [
        {"prefix": kind.prefix, "solid": kind.solid, **kind.offer._asdict()} for kind in OUTPUTS if kind.offer
    ]


def split_name(text: str) -> tuple[str, str]:
    """Return the prefix that a name has, or implies, and its path: an image with ``<UDIM>`` is an atlas."""
    prefix = next((kind.prefix for kind in OUTPUTS if kind.prefix and text.startswith(kind.prefix)), "")
    place = text.removeprefix(prefix)
    path = Path(place)
    if not prefix and path.suffix.lower() in PICTURES:
        meant = (kind for kind in OUTPUTS if (UDIM in path.name and kind.tiles) or path.stem == kind.stem)
        prefix = next((kind.prefix for kind in meant), "")
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
