"""Textures pass; half a sky, a frame and an object before a background are told."""

from pathlib import Path

import numpy as np
import pytest

from upholster.image.files.read import read_image
from upholster.image.sameness import differing_region

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.png")), ids=lambda path: path.stem)
def test_textures_are_one(path: Path) -> None:
    pixels = read_image(path)
    assert differing_region(pixels) is None
    assert differing_region(pixels[:, :, :1]) is None
    assert differing_region(pixels.astype(np.uint16) * 257) is None


def test_what_is_no_texture_is_reported() -> None:
    pixels = read_image(EXAMPLES / "pebbles.png")
    height, width = pixels.shape[:2]
    sky, framed, thing = pixels.copy(), pixels.copy(), pixels.copy()
    sky[: height // 2] = (120, 170, 250)
    framed[: height // 12] = framed[-height // 12 :] = 255
    framed[:, : width // 12] = framed[:, -width // 12 :] = 255
    thing[height // 4 : -height // 4, width // 4 : -width // 4] = (250, 250, 20)
    assert differing_region(sky) == "the upper half"
    assert differing_region(framed) == "the rim"
    assert differing_region(thing) == "the middle"
    assert differing_region(sky[:8]) is None  # too little to tell
