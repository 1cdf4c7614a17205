"""The figure of directions, the last of which is a function in Python."""

from typing import Any

import numpy as np

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars, cover, read, take
from upholster.geometry.built_in.cyclide import ring_cyclide

__all__ = ["directions"]

WAYS = ("u", "v", "30", "0,0,1", "around:z", "swirl")
"""What the figure shows, in order; the last is a function."""


def directions(_exemplars: Exemplars) -> Any:
    """Let the rows of one exemplar run six ways over the cyclide."""
    exemplar, surface = read(OWN / "bricks.png"), ring_cyclide()
    panels = []
    for letter, way in zip("abcdef", WAYS, strict=True):
        model = cover(
            surface,
            exemplar,
            texels=2_000_000,
            sample_size=6.0,
            seed=1,
            direction=_swirl if way == "swirl" else way,
        )
        words = "a function in Python" if way == "swirl" else way
        panels.append(Panel(take(model, size=(460, 350), view=(150.0, 32.0)).image, f"({letter}) {words}"))
    return compose([panels[:3], panels[3:]], gap=14)


def _swirl(points: Any) -> Any:
    """Return vectors that turn from round the axis to along it as z grows."""
    x, y, z = points.T
    turn = np.pi / 4 * (1 + z / np.abs(z).max())
    far = np.hypot(x, y)
    return np.stack([-y / far * np.cos(turn), x / far * np.cos(turn), np.sin(turn)], axis=1)
