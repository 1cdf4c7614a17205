"""Covered surfaces: seams, size and direction of the texture, over samples × surfaces, by method "quilt"."""

import sys

import numpy as np

import upholster
from benchmarks.measure import Request, one_pixel_a_texel, samples
from benchmarks.tables import Table
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import PixelArray
from upholster.covering.measure import Measures, measure_cover
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.synthesis.execution import execute
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.setup import prepare

__all__ = ["measured"]

SURFACES = ("cyclide", "torus", "sphere", "vase")
FIGURES = {
    "seam ratio across chart borders (1: invisible)": ("seams", "edges", "{:.2f}"),
    "chart borders, against the sample": ("seams", "edges_matched", "{:.2f}"),
    "seam ratio across block cuts": ("seams", "cuts", "{:.2f}"),
    "block cuts, against the sample": ("seams", "cuts_matched", "{:.2f}"),
    "area where the size is within 5 %": ("mapping", "within", "{:.1%}"),
    "area where the direction is within 5°": ("mapping", "aligned", "{:.1%}"),
    "texel area, 99th over 1st percentile": ("scale", "spread", "{:.2f}"),
}
"""Rows of the table: name, fields of `Measures`, and format."""


def measured(request: Request) -> Table:
    """Return medians over the samples."""
    chosen = samples(request)
    found: dict[str, list[Measures]] = {spec: [] for spec in SURFACES}
    for name, (exemplar, _) in chosen.items():
        for spec, own in found.items():
            own.append(_covered(exemplar, spec, request.texels or 2**22))
            print(name, spec, *_figures(own[-1:]), file=sys.stderr, flush=True)
    cells = zip(*(_figures(own) for own in found.values()), strict=True)
    note = f"Medians of {len(chosen)} samples, one seed. "
    note += "Aims of the first four rows: 0.95 to 1.05 and 0.9 to 1.1."
    rows = [[name, *own] for name, own in zip(FIGURES, cells, strict=True)]
    return Table(("measure", *SURFACES), rows, {"note": note})


def _covered(exemplar: PixelArray, spec: str, texels: int) -> Measures:
    surface = surface_from_spec(spec)
    prepared = prepare(
        Exemplar(exemplar), surface, SynthesisOptions(**one_pixel_a_texel(surface, exemplar, texels))
    )
    assert isinstance(prepared, Scene)
    quilt = execute(prepared, Exemplar(exemplar), surface, seed=1)
    painted = upholster.paint(quilt, exemplar, density=1.0)
    scale = None if prepared.scale is None else prepared.scale.scale
    direction, _, _ = prepared.direction.partition(", ")  # the default; then its singular points
    return measure_cover(surface, quilt, exemplar, texels=painted, scale=scale, direction=direction or None)


def _figures(found: list[Measures]) -> list[str]:
    return [
        shown.format(float(np.median([getattr(getattr(one, part), field) for one in found])))
        for part, field, shown in FIGURES.values()
    ]
