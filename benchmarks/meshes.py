"""Covered meshes: seams, size and direction of the texture, over models, with one sample and no option.

A model that can not be covered is reported by name, and the rest goes on.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import EXEMPLAR, Request
from benchmarks.tables import Table
from upholster.base.errors import UpholsterError
from upholster.base.formats import MESH_SUFFIXES
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.creases import CREASE, default_crease
from upholster.charts.directions.direction import parse_direction
from upholster.charts.directions.field import default_direction
from upholster.charts.directions.level_directions import requested_at_corners
from upholster.charts.surface_to_cover import as_covered
from upholster.covering.measure import mesh_mapping, mesh_seams
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.files.read import read_exemplar
from upholster.quilt.painting import paint
from upholster.synthesis.execution import execute
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.setup import prepare

__all__ = ["COLUMNS", "covered", "measured", "spread_over"]

SMOOTH = 5.0
"""Degrees: seams at which the surface turns by less are smooth."""


@dataclass(frozen=True)
class Row:
    """Figures of one model, 0 where there are none; without triangles `said` tells why.

    Attributes
    ----------
    seams
        Seam ratio against the sample where texture goes on.
    smooth, bent
        Of the seams where it goes on those at which the surface turns by less than `SMOOTH`, and the others,
        by the mesh's own normals.
    within, elsewhere
        Share of the area with the right size, and with the right direction where texture can follow.
    """

    model: str
    triangles: int = 0
    seams: float = 0.0
    smooth: float = 0.0
    bent: float = 0.0
    within: float = 0.0
    elsewhere: float = 0.0
    said: str = ""


def measured(request: Request) -> Table:
    """Return median, mean and worst over the models."""
    rows = []
    for file in request.listed(MESH_SUFFIXES):
        rows.append(covered(file, request.texels))
        print(*astuple(rows[-1]), file=sys.stderr, flush=True)
    whole = [row for row in rows if row.triangles]
    note = {"note": f"{len(whole)} models, `bricks.png`, no option."}
    return Table(COLUMNS, spread_over(whole, "model", MEASURES), note)


def covered(model: Path, texels: int | None) -> Row:
    """Cover a model and measure it."""
    image = read_exemplar(EXEMPLAR)
    try:
        surface = as_covered(model).surface
        assert isinstance(surface, MeshSurface)
        prepared = prepare(Exemplar(image), surface, SynthesisOptions(texels=texels))
        quilt = execute(prepared, Exemplar(image), surface)
    except UpholsterError as error:
        return Row(model.name, said=str(error))
    assert prepared.scale is not None
    assert prepared.field is not None
    direction = parse_direction(default_direction(surface.mesh))
    asked = requested_at_corners(surface.mesh, direction, default_crease(surface.mesh))
    field = prepared.field
    wanted = field.corner_vectors if asked is None else field.with_flat_faces(asked)
    found = mesh_mapping(surface, quilt, scale=prepared.scale.scale, asked=wanted)
    looked = paint(quilt, image, density=1.0)
    across = mesh_seams(surface, quilt, looked, image, crease=CREASE)
    smooth = mesh_seams(surface, quilt, looked, image, crease=SMOOTH, by_normals=True)
    bent = mesh_seams(surface, quilt, looked, image, crease=CREASE, least=SMOOTH, by_normals=True)
    return Row(
        model.name,
        triangles=len(surface.island),
        seams=round(across.ratio or 0.0, 3),
        smooth=round(smooth.ratio or 0.0, 3),
        bent=round(bent.ratio or 0.0, 3),
        within=round(found.within, 4),
        elsewhere=round(found.aligned_slow or 0.0, 4),
    )


MEASURES = {
    "seams against the sample, where the texture goes on": ("seams", "{:.2f}", max),
    "area where the size is within 5 %": ("within", "{:.1%}", min),
    "area where the direction is within 5°, where texture can follow": ("elsewhere", "{:.1%}", min),
}
"""Rows of the table: name, field, format, and which end is the worst."""

COLUMNS = ("measure", "median", "mean", "worst", "which has it")


def spread_over(
    rows: Sequence[Any], label: str, measures: dict[str, tuple[str, str, Callable[..., Any]]]
) -> list[list[str]]:
    """Return a line for each measure: median, mean and worst over `rows`, and the `label` of the worst.

    A figure of 0 says that a row has none, as of seams where there are none.
    """
    table = []
    for name, (field, shown, worst) in measures.items():
        having = [row for row in rows if getattr(row, field)]
        values = [getattr(row, field) for row in having]
        last = worst(having, key=lambda row: getattr(row, field))
        figures = (np.median(values), np.mean(values), getattr(last, field))
        table.append([name, *(shown.format(float(figure)) for figure in figures), getattr(last, label)])
    return table
