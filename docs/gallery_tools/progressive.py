"""Figures of the stream: a model at rising shares of its coefficients, and the quality that bytes buy."""

from typing import Any

import numpy as np
from PIL import Image

from gallery_tools.shots import Exemplars, read
from upholster import synthesize
from upholster.geometry import Surface, ring_cyclide, torus
from upholster.image import resize_image
from upholster.levels import curve_picture, levels_picture
from upholster.outputs import WriteOptions
from upholster.stream import encode_stream

__all__ = ["curve", "levels"]


def levels(exemplars: Exemplars) -> Any:
    """Draw figure 13: two streams, each at 3, 5, 7, 15 and 100 % of the coefficients."""
    rows = [
        levels_picture(
            _stream(exemplars, kind, surface), options=WriteOptions(size=(300, 250), view=view, supersample=3)
        )
        for kind, surface, view in (
            ("regular", ring_cyclide(), (150.0, 36.0)),
            ("stochastic", torus(2.0, 0.9), (30.0, 40.0)),
        )
    ]
    return Image.fromarray(np.concatenate(rows))


def curve(exemplars: Exemplars) -> Any:
    """Plot the quality of the cyclide's stream over its bytes."""
    return Image.fromarray(curve_picture(_stream(exemplars, "regular", ring_cyclide()))[0])


def _stream(exemplars: Exemplars, kind: str, surface: Surface) -> bytes:
    liked = {"regular": ("brick_wall_red",), "stochastic": ("rust",)}
    exemplar = read(exemplars.of_kind(kind, liked[kind])[0])
    exemplar = np.ascontiguousarray(resize_image(exemplar, height=256, width=256)[:128, :128])
    return encode_stream(surface, synthesize(exemplar, surface, chart=144, seed=1), exemplar)
