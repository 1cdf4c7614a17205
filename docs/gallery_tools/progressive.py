"""Figures of the stream: a model at rising shares of its coefficients, and the quality that bytes buy."""

from typing import Any

import numpy as np
from PIL import Image

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars, read, take
from upholster import synthesize
from upholster.geometry import Surface, ring_cyclide, torus
from upholster.image import resize_image
from upholster.levels import curve_picture, levels_picture, refine_steps
from upholster.options import WriteOptions
from upholster.stream import encode_stream
from upholster.stream.prefix import Limit
from upholster.textured import TexturedModel

__all__ = ["curve", "levels", "refining"]

ARRIVED = (1_000, 5_000, 10_000, 20_000)
"""Bytes of a stream at which it is shown."""


def levels(_exemplars: Exemplars) -> Any:
    """Draw figure 13: two streams of the paper's profile, at 3, 5, 7, 15 % of the coefficients and whole."""
    rows = [
        levels_picture(
            _stream(name, surface), options=WriteOptions(size=(300, 250), view=view, supersample=3)
        )
        for name, surface, view in (
            ("bricks", ring_cyclide(), (150.0, 36.0)),
            ("granite", torus(2.0, 0.9), (30.0, 40.0)),
        )
    ]
    return Image.fromarray(np.concatenate(rows))


def refining(_exemplars: Exemplars) -> Any:
    """Draw the stream of the hero's quilt as its first kilobytes arrive."""
    exemplar, surface = read(OWN / "bricks.png"), ring_cyclide()
    quilt = synthesize(exemplar, surface, texels=4_000_000, sample_size=5.0, direction="around:z", seed=3)
    data = encode_stream(surface, quilt, exemplar)
    lengths = (*ARRIVED, len(data))
    panels = []
    for step in refine_steps(data, [Limit(most_bytes=length) for length in lengths]):
        quality = "all" if step.length == len(data) else f"{step.psnr:.1f} dB"
        shot = take(TexturedModel(surface, step.texels), size=(300, 250), view=(150.0, 32.0))
        panels.append(Panel(shot.image, f"{step.length:,} bytes: {quality}"))
    return compose([panels], gap=12)


def curve(_exemplars: Exemplars) -> Any:
    """Plot the quality of the cyclide's stream over its bytes."""
    return Image.fromarray(curve_picture(_stream("bricks", ring_cyclide()))[0])


def _stream(name: str, surface: Surface) -> bytes:
    # Samples of the project, at the paper's size.
    exemplar = resize_image(read(OWN / f"{name}.png"), height=128, width=128)
    quilt = synthesize(exemplar, surface, chart=144, seed=1, method="paper")
    return encode_stream(surface, quilt, exemplar, wavelet="haar", sample_quality="lossless")
