"""The figure of a stream of a quilt, as its bytes arrive."""

from typing import Any

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import OWN, Exemplars, read, take
from upholster import synthesize
from upholster.codec.stream.prefix import Limit
from upholster.codec.stream.writer import encode_stream
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.model.textured_model import TexturedModel
from upholster.output.levels import refine_steps

__all__ = ["refining"]

ARRIVED = (1_000, 5_000, 10_000, 20_000)
"""Bytes of a stream at which it is shown."""


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
