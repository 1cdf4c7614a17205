"""A flat surface that faces the eye shows the sample's own colours."""

import base64
from typing import Any

import numpy as np
import pytest

import upholster

pytestmark = pytest.mark.browser

COLOURS = ((140, 89, 73), (60, 60, 60), (40, 120, 200), (225, 215, 190))
MOST_APART = 3


def _facing(azimuth: float, elevation: float) -> upholster.Surface:
    """Return a square that faces the eye of a view."""
    a, e = np.radians((azimuth, elevation))
    right = np.array([np.cos(a), np.sin(a), 0.0])
    up = np.array([-np.sin(e) * np.sin(a), np.sin(e) * np.cos(a), np.cos(e)])
    rows = [[v * up + u * right for u in (-1, 1)] for v in (1, -1)]
    return upholster.Surface([upholster.RationalPatch.from_points(np.array(rows))])


def _stream(surface: upholster.Surface, colour: tuple[int, int, int], **maps: Any) -> str:
    sample = np.full((64, 64, 3), colour, np.uint8)
    sample[::8, ::8, 0] += 1  # a sample of one colour is none
    exemplar = upholster.Material({"albedo": sample, **maps}) if maps else sample
    quilt = upholster.synthesize(exemplar, surface, texels=(64, 64), seed=1)
    return base64.b64encode(upholster.encode_stream(surface, quilt, sample, maps=maps or None)).decode()


@pytest.mark.parametrize("kind", ["colour", "material"])
@pytest.mark.parametrize("view", [[30, 30], [120, 0]])
def test_colours_are_the_samples(tab: Any, site: Any, kind: str, view: list[int]) -> None:
    maps = {"roughness": np.full((64, 64, 1), 204, np.uint8)} if kind == "material" else {}
    tab.open(f"{site}/view/ball.uph").complete()
    for colour in COLOURS:
        tab.call(
            """
            const bytes = Uint8Array.from(atob(argument[0]), (letter) => letter.charCodeAt(0))
            viewer.setAttribute('background', 'none')
            await viewer.open(bytes)
            viewer.view = argument[1]
            """,
            [_stream(_facing(*view), colour, **maps), view],
        )
        tab.complete().settle_shape()
        picture = tab.picture()
        height, width = picture.shape[:2]
        middle = picture[height // 2 - 8 : height // 2 + 8, width // 2 - 8 : width // 2 + 8, :3]
        assert np.abs(middle.mean(axis=(0, 1)) - colour).max() <= MOST_APART, (
            colour,
            middle.mean(axis=(0, 1)),
        )
