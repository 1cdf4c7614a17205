"""Models covered by versions of the program, as `eye` compares them."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import upholster
from benchmarks.eye_measures import broken_windows
from benchmarks.eye_ways import Way
from benchmarks.sheet_cases import EXAMPLES
from benchmarks.unfolding import unfolded_windows
from upholster.base.lengths import parse_length
from upholster.image.color import from_linear
from upholster.image.files.write import write_image
from upholster.output.glb_picture import redrawn, shown_model
from upholster.runtime.parallel import running

__all__ = ["MODELS", "Model", "broken_on", "cover"]

SIZE = (768, 640)
SIDES = (32, 48, 64)


@dataclass(frozen=True)
class Model:
    """A surface, or a model's file below the data folder, and how it is covered and looked at.

    Attributes
    ----------
    on
        As the command takes it, or ``examples/…``, ``data/…``.
    size
        The width of a sample of 128 pixels; larger samples are larger in proportion.
    direction
        Of rows: around:z or level.
    view
        In degrees.
    """

    on: str
    size: str
    direction: str = "level"
    view: tuple[float, float] = (30.0, 30.0)

    def place(self, data: Path | None) -> str:
        """Return what the command takes; raise ValueError where that needs a folder of data."""
        kind, _, rest = self.on.partition("/")
        root = {"examples": EXAMPLES, "data": data}.get(kind)
        if kind == "data" and (root is None or not (root / rest).exists()):
            raise ValueError(f"model {rest} is not there; allowed: a folder that has it, by --data")
        return self.on if root is None else str((root / rest).resolve())

    def width(self, sample: Path) -> str:
        """Return a sample's width on it, as the command takes it."""
        number = self.size.rstrip("cm")
        pixels = upholster.read_exemplar(sample).shape[1]
        return f"{float(number) * pixels / 128:g}{self.size[len(number) :]}"


MODELS = {
    "torus": Model("torus", "0.9", "around:z", (40, 30)),
    "vase": Model("vase", "0.7", "around:z"),
    "chair": Model("examples/chair.glb", "24cm"),
    "spot": Model("data/models/spot_triangulated.obj", "0.5"),
    "house": Model("data/models/meshes/house.glb", "15cm"),
    "nut": Model("data/models/cad/pump-nut.brep", "9mm"),
}


def cover(way: Way, sample: Path, name: str, on: str, seed: int) -> Path:
    """Return a GLB of the covered model, next to its picture in PNG, both made where they are missing."""
    model, width = MODELS[name], MODELS[name].width(sample)
    picture = way.sheet(sample, seed, name)
    out = picture.with_suffix(".glb")
    if not picture.exists():
        way.folder.mkdir(parents=True, exist_ok=True)
        words = ["cover", str(sample), "--on", on, "--sample-size", width, "--direction", model.direction]
        words += ["--seed", str(seed), "--texture", "png", "-q", "-o", str(out)]
        out.unlink(missing_ok=True)
        subprocess.run([str(way.python), "-m", "upholster", *words], env=way.environment(), check=True)
        with running(1):
            (drawn,) = redrawn(out, [model.view], size=SIZE)
        write_image(picture, from_linear(drawn, np.uint8))
    return out


def broken_on(file: Path, sample: Path, name: str) -> float:
    """Return the figure of a covered model's windows, unfolded; NaN where none is large enough."""
    model, exemplar = MODELS[name], upholster.read_exemplar(sample)[:, :, :3]
    pixel = parse_length(model.width(sample), 1.0) / exemplar.shape[1]
    windows = unfolded_windows(shown_model(file), pixel, model.direction)
    sides = [side for side in SIDES if windows and side + 8 <= windows[0].shape[0]]
    return broken_windows(windows, exemplar, sides) if sides else float("nan")
