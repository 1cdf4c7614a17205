"""Figures of results: twelve textures on three surfaces, and the README's pictures."""

from pathlib import Path
from typing import Any

from gallery_tools.drawing import Panel, compose
from gallery_tools.shots import KINDS, OWN, Exemplars, cover, kind_of, read, side_by_side, take
from upholster.charts.surface_to_cover import as_covered
from upholster.geometry import Surface, ring_cyclide, sphere, torus, vase

__all__ = [
    "cad",
    "cad_lacking",
    "chairs",
    "hero",
    "players",
    "players_lacking",
    "strip",
    "twelve",
    "twelve_paths",
]

LIKED = {
    "regular": ("gingham", "mosaic", "brick_wall_red"),
    "near_regular": ("wood_planks", "stone_wall", "cobble"),
    "irregular": ("pebbles", "leaves", "onyx"),
    "stochastic": ("asphalt", "bark", "rust"),
}
"""For each class, words in the names of the exemplars for sphere, torus and cyclide."""


def twelve_paths(exemplars: Exemplars) -> list[Path]:
    """Return which exemplars the figure with twelve textures shows, from (a) to (l)."""
    columns = [exemplars.of_kind(kind, LIKED[kind]) for kind in KINDS]
    return [column[row] for row in range(3) for column in columns]


def twelve(exemplars: Exemplars) -> Any:
    """Draw figure 12: sphere, torus and cyclide, each with a texture of every class."""
    rows: list[list[Panel]] = [[], [], []]
    surfaces: list[tuple[Surface, tuple[float, float], int]] = [
        (sphere(tiling="octants"), (45.0, 20.0), 192),
        (torus(2.0, 0.9), (30.0, 40.0), 144),
        (ring_cyclide(), (150.0, 36.0), 144),
    ]
    for n, path in enumerate(twelve_paths(exemplars)):
        surface, view, chart = surfaces[n // 4]
        exemplar = read(path)
        model = cover(surface, exemplar, method="paper", chart=chart, block=32, overlap=8, seed=n + 1)
        kind = (kind_of(path) or "").replace("_", " ")
        rows[n // 4].append(
            Panel(take(model, size=(330, 300), view=view).image, f"({'abcdefghijkl'[n]}) {kind}".strip())
        )
    return compose(rows, gap=14)


def hero(_exemplars: Exemplars) -> Any:
    """Make README's first picture: a cyclide of bricks."""
    exemplar = read(OWN / "bricks.png")
    model = cover(ring_cyclide(), exemplar, texels=4_000_000, sample_size=5.0, direction="around:z", seed=3)
    return take(model, size=(1000, 750), view=(150.0, 32.0), supersample=4).image


def chairs(_exemplars: Exemplars) -> Any:
    """Make README's picture of a model: an armchair in three materials, side by side on one floor."""
    surface = as_covered(OWN / "chair.glb").surface
    models = [
        cover(surface, read(OWN / name), texels=2_000_000, sample_size=size, seed=1)
        for name, size in (("weave.png", "18cm"), ("bricks.png", "35cm"), ("pebbles.png", "40cm"))
    ]
    return side_by_side(models, ((-1.1, 1.0), (0.0, 1.0), (1.1, 1.0)), size=(1200, 460), view=(14.0, 20.0))


def cad_lacking() -> str:
    """Return what the picture of CAD parts needs, which is not the project's: the teapot, and Blender."""
    return "cad_pictures of an earlier revision, which takes the teapot's file and Blender"


def cad(_exemplars: Exemplars) -> Any:
    """Stand for a picture that `cad_pictures` made."""
    raise AssertionError(cad_lacking())


def players_lacking() -> str:
    """Return what the picture of a rigged model needs, which is not the project's: the model, and Blender."""
    return "players of an earlier revision, which takes a model and Blender"


def players(_exemplars: Exemplars) -> Any:
    """Stand for a picture that `players` made."""
    raise AssertionError(players_lacking())


def strip(_exemplars: Exemplars) -> Any:
    """Make README's second picture: three surfaces with three more exemplars, side by side on one floor."""
    models = [
        cover(surface, read(OWN / name), texels=1_000_000, sample_size=size, seed=1, quads=12_000)
        for surface, name, size in (
            (torus(2.0, 0.9), "weave.png", 1.6),
            (vase(), "pebbles.png", 0.8),
            (sphere(), "granite.png", 0.9),
        )
    ]
    places = ((-2.3, 0.44), (0.0, 1.0), (2.05, 0.9))  # x of the middle, scale
    return side_by_side(models, places, size=(1200, 400), view=(0.0, 24.0))
