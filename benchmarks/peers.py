"""Other programs for textures, called in the same run as ours: those that are installed."""

import importlib.metadata
import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import upholster
from benchmarks.measure import EXEMPLAR, median_processor_seconds
from upholster.base.types import PixelArray
from upholster.geometry.built_in.plane import plane
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image

__all__ = ["LIMIT", "SIDE", "Filler", "Mask", "Method", "fillers", "gmic_seconds", "methods", "versions"]

SIDE = 512
"""Height and width of the textures."""

LIMIT = 120.0
"""Seconds that a peer may take."""

Mask = NDArray[np.bool_]
Method = Callable[[PixelArray, int], PixelArray]
"""``method(exemplar, seed)``, exemplar (h, w, C) uint8: a texture of `SIDE`²."""

Filler = Callable[[PixelArray, Mask], PixelArray]
"""``filler(photo, hole)``: the photo without its hole."""

_RESYNTHESIZE = """
import ctypes, sys
import resynthesizer
from PIL import Image
parameters = resynthesizer.getDefaultParams()
parameters.isMakeSeamlesslyTileableHorizontally = parameters.isMakeSeamlesslyTileableVertically = 0
if sys.argv[4:]:
    parameters.matchContextType = 0  # nothing around a texture is matched
    ctypes.CDLL(None).srand(int(sys.argv[4]))  # it draws from the C library's generator
photo, mask = Image.open(sys.argv[1]).convert("RGB"), Image.open(sys.argv[2]).convert("L")
resynthesizer.resynthesize(photo, mask, parameters).save(sys.argv[3])
"""


def installed() -> tuple[str, ...]:
    """Return the peers that are installed."""
    here = {"G'MIC": shutil.which("gmic"), "resynthesizer": importlib.util.find_spec("resynthesizer")}
    return tuple(name for name, found in here.items() if found)


def versions(*names: str) -> str:
    """Return the versions of the named peers, in words; those that are not installed are left out aloud."""
    found = []
    for name in names:
        if name not in installed():
            print(f"{name} is left out: it is not installed", file=sys.stderr)
        elif name == "G'MIC":
            said = subprocess.run(["gmic", "version"], capture_output=True, text=True)
            number = re.search(r"Version (\d[\d.]*\d)", said.stdout + said.stderr)
            found.append(f"{name} {number[1]}" if number else name)
        else:
            found.append(f"{name} {importlib.metadata.version(name)}")
    return ", ".join(found)


def methods() -> dict[str, Method]:
    """Return our methods and the installed peers, by name."""
    peers = {"G'MIC": _gmic_texture, "resynthesizer": _resynthesizer_texture}
    return {"quilt": _quilt, "paper": _paper} | {name: peers[name] for name in installed()}


def fillers() -> dict[str, Filler]:
    """Return our way to fill a hole and those of the installed peers, by name."""
    peers: dict[str, dict[str, Filler]] = {
        # By patches of 11 pixels, as its graphical filter begins; without numbers it only spreads colours.
        "G'MIC": {
            "G'MIC inpaint": lambda photo, hole: _gmic_hole(
                photo, hole, "inpaint[0]", "[1],11,22,0.5,1,9,0,0.05,10,1"
            ),
            "G'MIC matchpatch": lambda photo, hole: _gmic_hole(photo, hole, "inpaint_matchpatch[0]", "[1]"),
        },
        "resynthesizer": {"resynthesizer": _resynthesizer_hole},
    }
    found: dict[str, Filler] = {"`upholster fill`": _ours}
    _ours(np.full((64, 64, 3), 128, np.uint8), np.indices((64, 64))[0] > 60)  # kernels are loaded
    for name in installed():
        found |= peers[name]
    return found


def gmic_seconds() -> float | None:
    """Return G'MIC's processor seconds from 128² to 512², without its start; None: it is not installed."""
    if "G'MIC" not in installed():
        return None
    with tempfile.TemporaryDirectory() as folder:
        sample = f"{folder}/sample.png"
        write_image(sample, upholster.read_exemplar(EXEMPLAR, resize=128))

        def run(*command: str) -> None:
            subprocess.run(["gmic", "-v", "-", sample, *command, "-o", f"{folder}/out.png"], check=True)

        making = median_processor_seconds(lambda: run("syntexturize_matchpatch", "512,512"), runs=5)
        return making - median_processor_seconds(run, runs=5)


def _quilt(exemplar: PixelArray, seed: int) -> PixelArray:
    quilt = upholster.synthesize(exemplar, plane(), texels=(SIDE, SIDE), seed=seed)
    return upholster.paint(quilt, exemplar).arrays[0]


def _paper(exemplar: PixelArray, seed: int) -> PixelArray:
    quilt = upholster.synthesize(exemplar, plane(), method="paper", chart=SIDE, seed=seed)
    return upholster.paint(quilt, exemplar).arrays[0]


def _ours(photo: PixelArray, hole: Mask) -> PixelArray:
    found = upholster.fill(photo, hole)
    assert isinstance(found, np.ndarray)
    return found


def _gmic_texture(exemplar: PixelArray, _seed: int) -> PixelArray:
    # Its random numbers take no seed: each call gives another texture.
    command = ["gmic", "-v", "-", "0.png", "syntexturize_matchpatch", f"{SIDE},{SIDE}", "-o", "out.png"]
    return _by_files(command, exemplar)


def _gmic_hole(photo: PixelArray, hole: Mask, *command: str) -> PixelArray:
    words = ["gmic", "-v", "-", "0.png", "1.png", *command, "-o[0]", "out.png"]
    return _by_files(words, photo, _white_in(hole))


def _resynthesizer_texture(exemplar: PixelArray, seed: int) -> PixelArray:
    # It fills the masked part of a picture from the rest: the exemplar is in the corner of a larger one.
    height, width, channels = exemplar.shape
    picture = np.zeros((SIDE, SIDE + width, channels), np.uint8)
    picture[:height, :width] = exemplar
    mask = np.ones(picture.shape[:2], np.bool_)
    mask[:height, :width] = False
    command = [sys.executable, "-c", _RESYNTHESIZE, "0.png", "1.png", "out.png", str(seed)]
    return np.ascontiguousarray(_by_files(command, picture, _white_in(mask))[:, width:])


def _resynthesizer_hole(photo: PixelArray, hole: Mask) -> PixelArray:
    command = [sys.executable, "-c", _RESYNTHESIZE, "0.png", "1.png", "out.png"]
    return _by_files(command, photo, _white_in(hole))


def _white_in(mask: Mask) -> PixelArray:
    return np.where(mask, 255, 0).astype(np.uint8)[:, :, None]


def _by_files(command: list[str], *pictures: PixelArray) -> PixelArray:
    """Run a program in a folder with 0.png and so on; return out.png with the first one's channels."""
    with tempfile.TemporaryDirectory() as folder:
        for n, picture in enumerate(pictures):
            write_image(f"{folder}/{n}.png", picture)
        subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=LIMIT)
        found = read_image(f"{folder}/out.png")
    count = pictures[0].shape[2]
    if found.shape[2] < count:  # programs write grey as RGB, or the reverse
        return np.repeat(found[:, :, :1], count, axis=2)
    return np.ascontiguousarray(found[:, :, :count])
