"""Programs that make a large flat texture of a small one: ours and its peers, each as one function."""

import ctypes
import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

import upholster
from upholster.geometry import plane
from upholster.image import read_image, write_image
from upholster.options import METHODS
from upholster.quilt import Quilt
from upholster.types import PixelArray

__all__ = ["SIDE", "Made", "Method", "methods", "versions"]

SIDE = 512
"""Height and width of what is made."""


@dataclass(frozen=True)
class Made:
    """A texture, and the quilt it was painted from, if there is one."""

    image: PixelArray
    quilt: Quilt | None = None


Method = Callable[[PixelArray, int], Made]
"""``method(exemplar, seed)``, exemplar (h, w, C) uint8."""


def versions(*names: str) -> str:
    """Return the versions of G'MIC and resynthesizer as far as they are named and installed, in words."""
    found = []
    if "G'MIC" in names and shutil.which("gmic"):
        said = subprocess.run(["gmic", "version"], capture_output=True, text=True)
        number = re.search(r"Version (\d[\d.]*\d)", said.stdout + said.stderr)
        found.append(f"G'MIC {number[1]}" if number else "G'MIC")
    if "resynthesizer" in names and importlib.util.find_spec("resynthesizer"):
        found.append(f"resynthesizer {importlib.metadata.version('resynthesizer')}")
    return ", ".join(found)


def methods() -> tuple[dict[str, Method], dict[str, str]]:
    """Return the methods that are here by name, and why others are not."""
    here: dict[str, Method] = {}
    missing: dict[str, str] = {}
    for name, make in (("quilt", _quilt), ("paper", _paper)):
        if name in METHODS:
            here[name] = make
        else:
            missing[name] = "not in this version"
    if shutil.which("gmic"):
        here["G'MIC"] = _gmic
    else:
        missing["G'MIC"] = "the program gmic is not installed"
    try:
        import resynthesizer  # noqa: F401  # only to see whether it is installed

        here["resynthesizer"] = _resynthesizer
    except ImportError:
        missing["resynthesizer"] = "the package is not installed (extra `fidelity`)"
    return here, missing


def _quilt(exemplar: PixelArray, seed: int) -> Made:
    quilt = upholster.synthesize(exemplar, plane(), method="quilt", texels=(SIDE, SIDE), seed=seed)
    return Made(upholster.paint(quilt, exemplar).arrays[0], quilt)


def _paper(exemplar: PixelArray, seed: int) -> Made:
    quilt = upholster.synthesize(exemplar, plane(), method="paper", chart=SIDE, seed=seed)
    return Made(upholster.paint(quilt, exemplar).arrays[0], quilt)


def _gmic(exemplar: PixelArray, _seed: int) -> Made:
    with tempfile.TemporaryDirectory() as folder:
        sample, out = f"{folder}/sample.png", f"{folder}/out.png"
        write_image(sample, exemplar)
        # Its random numbers take no seed: each call gives another texture.
        command = ["gmic", "-v", "-", sample, "syntexturize_matchpatch", f"{SIDE},{SIDE}", "-o", out]
        subprocess.run(command, check=True, capture_output=True)
        found = read_image(out)
    return Made(_channels_of(found, exemplar))


def _resynthesizer(exemplar: PixelArray, seed: int) -> Made:
    import resynthesizer
    from PIL import Image

    # It fills the masked part of a picture from the rest: the exemplar stands in the corner of a larger one.
    height, width, channels = exemplar.shape
    picture = np.zeros((SIDE, SIDE + width, 3), np.uint8)
    picture[:height, :width] = exemplar[:, :, : 3 if channels > 2 else 1]
    mask = np.full(picture.shape[:2], 255, np.uint8)
    mask[:height, :width] = 0
    parameters = resynthesizer.getDefaultParams()
    parameters.isMakeSeamlesslyTileableHorizontally = parameters.isMakeSeamlesslyTileableVertically = 0
    parameters.matchContextType = 0  # nothing round the hole is to be matched
    # It draws from the C library's generator.
    ctypes.CDLL(None).srand(seed)
    with _silence():
        found = resynthesizer.resynthesize(Image.fromarray(picture), Image.fromarray(mask), parameters)
    return Made(_channels_of(np.asarray(found)[:, width:], exemplar))


def _channels_of(found: PixelArray, exemplar: PixelArray) -> PixelArray:
    """Return an image with the exemplar's channels: programs write grey as RGB or the reverse."""
    count = exemplar.shape[2]
    if found.shape[2] < count:
        return np.repeat(found[:, :, :1], count, axis=2)
    return np.ascontiguousarray(found[:, :, :count])


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what a library prints by itself from the terminal."""
    kept = os.dup(1)
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
