"""The 24 cases of `benchmarks.sheet`, and the files that they need.

A file is named by where it lies: ``examples/…`` in the project, ``made/…`` in a folder that `make_inputs`
fills, ``data/…`` in a folder of the user's own, which may lack it: then the case is skipped.
"""

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from scipy.ndimage import gaussian_filter

from benchmarks.cad_part import rounded_part, write_assembly
from benchmarks.lattice_samples import lattice_sample
from benchmarks.measure import EXEMPLAR
from benchmarks.nets import bent_vase, write_nets
from upholster.base.lengths import parse_length
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image

__all__ = ["CASES", "EXAMPLES", "Case", "make_inputs", "places"]

EXAMPLES = EXEMPLAR.parent
CAD = (".step", ".stp", ".iges", ".igs", ".brep", ".3dm")
BLUR = 2.0
"""Of the smooth sample, in pixels: with nothing sharp in it, seams have nothing to hide behind."""


@dataclass(frozen=True)
class Case:
    """One command ``upholster cover``.

    Attributes
    ----------
    name
        Of the case, and of its files.
    sample
        The file of an image, or the folder of a material.
    on
        A surface as the command takes it, or the file of a model; `plane` is flat.
    size
        What ``--sample-size`` says; empty where the method has none.
    direction
        What ``--direction`` says: level or around:z. Empty where the method has none.
    pixels
        Of the sample's longer side: ``--resize``. At these sizes a texel is about a pixel of the sample.
    options
        What else the command gets.
    view
        From where the picture is taken, in degrees.
    """

    name: str
    sample: str
    on: str
    size: str = ""
    direction: str = ""
    pixels: int = 128
    options: tuple[str, ...] = ()
    view: tuple[float, float] = (30.0, 30.0)

    @property
    def is_flat(self) -> bool:
        """Whether the result is a picture."""
        return self.on == "plane"

    @property
    def is_tile(self) -> bool:
        """Whether it is a picture that wraps."""
        return "--tileable" in self.options

    @property
    def has_stream(self) -> bool:
        """Whether the result can be written as a stream, too."""
        return "pixel" not in self.options

    @property
    def files(self) -> tuple[str, ...]:
        """What the case reads."""
        return tuple(name for name in (self.sample, self.on) if "/" in name)

    @property
    def is_cad(self) -> bool:
        """Whether Open CASCADE is needed."""
        return self.on.endswith(CAD)

    @property
    def length(self) -> float:
        """The sample's width in units of the GLB: metres, where the size has a unit."""
        return parse_length(self.size, 1.0)

    def words(self, where: Mapping[str, Path]) -> list[str]:
        """Return the command's arguments, without outputs; `where` has the files that are not names."""
        sample, on = (str(where.get(name, name)) for name in (self.sample, self.on))
        words = ["cover", sample, "--on", on, "--resize", str(self.pixels), *self.options]
        words += ["--sample-size", self.size] if self.size else []
        return words + (["--direction", self.direction] if self.direction else [])


def _flat(name: str, sample: str, texels: str, *options: str) -> Case:
    return Case(name, sample, "plane", options=("--texels", texels, *options))


_BOARDS = "data/textures/near_regular_wood_planks_beam_wall_ph.png"
_ROUND, _LEVEL, _FEW = "around:z", "level", ("--chart", "128")

CASES: tuple[Case, ...] = (
    _flat("flat_bricks", "examples/bricks.png", "512x512"),
    _flat("flat_granite", "examples/granite.png", "768x384"),
    _flat("flat_gravel", "examples/gravel.png", "1024x1024"),
    _flat("tile_pebbles", "examples/pebbles.png", "512x512", "--tileable"),
    Case("cyclide_bricks", "examples/bricks.png", "cyclide", "6", _ROUND),
    Case("torus_weave", "examples/weave.png", "torus", "1.6", _ROUND),
    Case("vase_pebbles", "examples/pebbles.png", "vase", "1", _ROUND),
    Case("sphere_granite", "examples/granite.png", "sphere", "0.77", _ROUND),
    Case("net_hexagons", "made/hexagons.png", "made/net.json", "1", _ROUND),
    Case("cylinder_boards", _BOARDS, "cylinder", "0.77", _ROUND),
    Case("torus_smooth", "made/smooth_gravel.png", "torus", "1.6", _ROUND),
    Case("sphere_herringbone", "made/herringbone.png", "sphere", "0.77", _ROUND),
    Case("cyclide_wall", "data/textures/near_regular_brick_wall_old_ph005.png", "cyclide", "8", _ROUND, 192),
    Case("chair_weave", "examples/weave.png", "examples/chair.glb", "36cm", _LEVEL),
    Case("spot_boards", _BOARDS,
         "data/models/spot_triangulated.obj", "0.52", _LEVEL),
    Case("fox_gravel", "examples/gravel.png", "data/models/meshes/fox.glb", "27m", _LEVEL),
    Case("house_bricks", "examples/bricks.png", "data/models/meshes/house.glb", "15cm", _LEVEL),
    Case("spot_smooth", "made/smooth_gravel.png", "data/models/spot_triangulated.obj", "0.52", _LEVEL),
    Case("part_granite", "examples/granite.png", "made/part.step", "22mm", _LEVEL),
    Case("nut_bricks", "examples/bricks.png", "data/models/cad/pump-nut.brep", "18mm", _LEVEL),
    Case("torus_material", "examples/bricks_material", "torus", "1.6", _ROUND),
    Case("chair_rust", "data/materials/rusty_metal053C", "examples/chair.glb", "36cm", _LEVEL),
    Case("paper_bricks", "examples/bricks.png", "cyclide", options=("--method", "paper", *_FEW)),
    Case("pixel_pebbles", "examples/pebbles.png", "torus", options=("--method", "pixel", *_FEW)),
)  # fmt: skip


def places(cases: tuple[Case, ...], made: Path, data: Path | None) -> tuple[dict[str, Path], dict[str, str]]:
    """Return where the cases' files lie, and why which cases cannot be run."""
    roots = {"examples": EXAMPLES, "made": made, "data": data}
    where: dict[str, Path] = {}
    missing: dict[str, str] = {}
    for case in cases:
        for name in case.files:
            kind, _, rest = name.partition("/")
            root = roots[kind]
            if root is not None and (root / rest).exists():
                where[name] = (root / rest).resolve()
            elif root is None:
                missing[case.name] = f"needs {rest} of a folder of data: --data"
            else:
                missing[case.name] = f"there is no {rest} in {root}"
        if case.is_cad and not _has_cad():
            missing[case.name] = "needs Open CASCADE: pip install '.[cad]'"
    return where, missing


def make_inputs(folder: Path) -> None:
    """Write the inputs that are made: once, for a STEP file holds the time at which it was written."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("hexagons", "herringbone"):
        if not (folder / f"{name}.png").exists():
            write_image(folder / f"{name}.png", lattice_sample(name, side=256).image)
    if not (folder / "smooth_gravel.png").exists():
        sharp = read_image(EXAMPLES / "gravel.png")
        # The command halves it: so twice the blur here.
        smooth = gaussian_filter(sharp.astype(float), (2 * BLUR, 2 * BLUR, 0), mode="mirror")
        write_image(folder / "smooth_gravel.png", smooth.round().astype(sharp.dtype))
    if not (folder / "net.json").exists():
        write_nets(folder / "net.json", bent_vase())
    if not (folder / "part.step").exists() and _has_cad():
        write_assembly(folder / "part.step", rounded_part())


def _has_cad() -> bool:
    return importlib.util.find_spec("OCP") is not None
