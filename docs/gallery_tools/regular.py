"""Figures of repeating samples, before and after; and of photographs that nobody chose."""

from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.lattice_samples import lattice_sample
from PIL import Image

import upholster
from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import KINDS, OWN, Exemplars, cover, read, take
from upholster.geometry import Surface, surface_from_spec
from upholster.types import PixelArray

__all__ = ["PHOTOGRAPHS", "irregular", "photograph_paths", "regular", "repeating"]

CASES = (
    ("bricks", "cyclide", 5.0, (150.0, 32.0)),
    ("herringbone", "vase", 1.0, (30.0, 20.0)),
    ("stack_bond", "sphere", 0.8, (30.0, 25.0)),
    ("weave", "torus:R=2,r=0.9", 1.6, (30.0, 38.0)),
    ("running_bond", "net", 1.2, (30.0, 16.0)),
    ("gingham", "torus:R=2,r=0.9", 2.2, (30.0, 38.0)),
    ("herringbone", "flat", 1.0, (0.0, 90.0)),
    ("basket_weave", "flat", 1.0, (0.0, 90.0)),
)
"""Sample, surface, the sample's size there, and where it is looked at from; flat ones as they are."""

SHOT = (430, 360)

SURFACES = (
    ("torus:R=2,r=0.9", (30.0, 38.0)),
    ("cyclide", (150.0, 32.0)),
    ("vase", (30.0, 20.0)),
    ("sphere", (30.0, 25.0)),
)

PHOTOGRAPHS = 3
"""Of each class of texture, the first by name."""


def repeating(_exemplars: Exemplars) -> Any:
    """Cover surfaces with samples that repeat: without phases, and as it is by default."""
    rows = []
    for name, spec, size, view in CASES:
        exemplar, panels = _sample(name), []
        for words, options in (("before", {"phase": 0}), ("now", {})):
            if spec == "flat":
                image = _flat(exemplar, **options)
            else:
                chosen: dict[str, Any] = {"sample_size": size, "direction": "around:z", "seed": 1, **options}
                model = cover(_surface(spec), exemplar, texels=2_000_000, **chosen)
                image = take(model, size=SHOT, view=view).image
            panels.append(Panel(image, f"{name.replace('_', ' ')}, {words}"))
        rows.append(panels)
    half = len(rows) // 2
    return compose([a + b for a, b in zip(rows[:half], rows[half:], strict=True)], gap=12)


def _flat(exemplar: PixelArray, **options: Any) -> Any:
    # The upper left of a flat texture of 512 × 512.
    quilt = upholster.synthesize(exemplar, upholster.plane(), texels=(512, 512), seed=1, **options)
    texels = upholster.paint(quilt, exemplar).arrays[0]
    return Image.fromarray(np.ascontiguousarray(texels[: SHOT[1], : SHOT[0], :3]))


def photograph_paths(exemplars: Exemplars, kinds: tuple[str, ...]) -> list[Path]:
    """Return the photographs of a figure: of each class the first ones by name."""
    return [path for kind in kinds for path in exemplars.of_kind(kind, ("",) * PHOTOGRAPHS)]


def regular(exemplars: Exemplars) -> Any:
    """Cover four surfaces with photographs of regular and nearly regular textures."""
    return _photographs(photograph_paths(exemplars, KINDS[:2]))


def irregular(exemplars: Exemplars) -> Any:
    """Cover four surfaces with photographs of irregular and stochastic textures."""
    return _photographs(photograph_paths(exemplars, KINDS[2:]))


def _photographs(paths: list[Path]) -> Any:
    rows = []
    for letter, path in zip("abcdef", paths, strict=True):
        exemplar = read(path)
        panels = [Panel(Image.fromarray(exemplar).resize((230, 230)), f"({letter}) sample")]
        for spec, view in SURFACES:
            model = cover(surface_from_spec(spec), exemplar, texels=1_000_000, seed=1)
            panels.append(Panel(take(model, size=(270, 230), view=view).image, spec.split(":")[0]))
        rows.append(panels)
    return compose(rows, gap=10)


def _sample(name: str) -> PixelArray:
    # One of the project's own, or a generated lattice.
    if (OWN / f"{name}.png").exists():
        return read(OWN / f"{name}.png")
    image: PixelArray = lattice_sample(name, side=256).image
    return image


def _surface(spec: str) -> Surface:
    from benchmarks.nets import bent_vase

    return bent_vase() if spec == "net" else surface_from_spec(spec)
