"""Covered meshes: time, charts, seams, size and direction, over models × one sample each.

``python -m benchmarks.meshes FOLDER|FILE … [-o OUT] [--sample IMAGE] [--texels N] [--publish]``. Writes
meshes.csv and a picture of each to OUT. A model that can not be covered is reported by name, and the rest
goes on.

With ``--strokes N`` the only direction is that of N random strokes, and what is measured is how they are
followed: see `asked_by_strokes`.

With ``--refine N`` nothing is covered: the longest edges of each model are halved until it has N triangles,
and it is written to OUT as PLY, for ``upholster cover``.
"""

import argparse
import csv
import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.tables import write_table
from upholster.charts.charted import ChartedSurface
from upholster.charts.creases import CREASE, default_crease
from upholster.charts.directions import (
    asked_at_corners,
    asked_by_strokes,
    default_direction,
    parse_direction,
)
from upholster.charts.subdivision import subdivided
from upholster.charts.surface_to_cover import as_covered
from upholster.errors import UpholsterError
from upholster.export import write_bare_ply
from upholster.formats import CAD_SUFFIXES, is_model_name
from upholster.geometry import MeshSurface, TriangleMesh
from upholster.geometry.mesh_files import read_model
from upholster.image import from_linear, read_exemplar, write_image
from upholster.measure import mesh_mapping, mesh_seams, mesh_texel_scale
from upholster.methods import Exemplar, execute, prepare
from upholster.options import SynthesisOptions
from upholster.quilt import paint
from upholster.textured import TexturedModel
from upholster.types import FloatArray

__all__ = ["COLUMNS", "Row", "main", "measured", "spread_over"]

BRICKS = Path(__file__).parent.parent / "examples" / "bricks.png"


SMOOTH = 5.0
"""Degrees: seams at which the surface turns by less are smooth."""


@dataclass(frozen=True)
class Row:
    """Figures of one model.

    Attributes
    ----------
    seams, over
        Seam ratio where texture goes on, and over creases.
    smooth, bent
        Of the seams where it goes on those at which the surface turns by less than `SMOOTH`, and the others,
        by the mesh's own normals.
    """

    model: str
    triangles: int = 0
    plain: int = 0
    charts: int = 0
    texels: int = 0
    placements: int = 0
    singular: int = 0
    read: float = 0.0
    prepare: float = 0.0
    synthesize: float = 0.0
    paint: float = 0.0
    seams: float = 0.0
    creases: float = 0.0
    over: float = 0.0
    smooth: float = 0.0
    bent: float = 0.0
    within: float = 0.0
    aligned: float = 0.0
    fast: float = 0.0
    elsewhere: float = 0.0
    spread: float = 0.0
    said: str = ""


def measured(model: Path, sample: Path, out: Path | None, options: SynthesisOptions, strokes: int = 0) -> Row:
    """Cover a model, measure it, and draw it where `out` names a folder."""
    image = read_exemplar(sample)
    clock = [time.perf_counter()]
    try:
        covered = as_covered(model)
        surface = covered.surface
        assert isinstance(surface, MeshSurface)
        if strokes:
            options = replace(options, stroke=random_strokes(surface.mesh, strokes))
        clock.append(time.perf_counter())
        scene = prepare(Exemplar(image), surface, options)
        clock.append(time.perf_counter())
        quilt = execute(scene, Exemplar(image), surface)
        clock.append(time.perf_counter())
        painted = paint(quilt, image)
        clock.append(time.perf_counter())
    except UpholsterError as error:
        return Row(model.name, said=str(error))
    if out is not None:
        picture = TexturedModel(surface, painted, quilt=quilt, exemplar=image).picture()
        write_image(out / f"{model.stem}.png", from_linear(picture, "uint8", dither=True))
    assert scene.scale is not None
    assert scene.field is not None
    crease = CREASE if options.crease is None else options.crease
    anew = default_crease(surface.mesh) if options.crease is None else options.crease
    asked = _asked(surface.mesh, options, anew)
    field = scene.field
    if asked is None:
        asked = field.corner_vectors
    elif options.stroke is None:
        asked = field.as_faces_run(asked)
    found, looked = mesh_mapping(surface, quilt, scale=scene.scale.scale, asked=asked), painted
    if quilt.density != 1:
        looked = paint(quilt, image, density=1.0)
    across = mesh_seams(surface, quilt, looked, image, crease=crease)
    smooth = mesh_seams(surface, quilt, looked, image, crease=SMOOTH, by_normals=True)
    bent = mesh_seams(surface, quilt, looked, image, crease=crease, least=SMOOTH, by_normals=True)
    seconds = [round(b - a, 3) for a, b in itertools.pairwise(clock)]
    return Row(
        model.name,
        triangles=len(surface.island),
        plain=int((surface.island < 0).sum()),
        charts=len(quilt.charts),
        texels=painted.count,
        placements=len(quilt.placements),
        singular=len(scene.field.singular),
        read=seconds[0],
        prepare=seconds[1],
        synthesize=seconds[2],
        paint=seconds[3],
        seams=round(across.ratio or 0.0, 3),
        creases=round(across.creases, 3),
        over=round(across.over_creases or 0.0, 3),
        smooth=round(smooth.ratio or 0.0, 3),
        bent=round(bent.ratio or 0.0, 3),
        within=round(found.within, 4),
        aligned=round(found.aligned or 0.0, 4),
        fast=round(found.fast or 0.0, 4),
        elsewhere=round(found.aligned_slow or 0.0, 4),
        spread=round(mesh_texel_scale(surface, quilt.charts).spread, 3),
        said="; ".join(covered.notes),
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


def _publish(rows: Sequence[Row]) -> None:
    covered = [row for row in rows if row.triangles]
    note = f"{len(covered)} models, `bricks.png`, no option."
    command = "python -m benchmarks.meshes FOLDER --publish"
    write_table("meshes", COLUMNS, spread_over(covered, "model", MEASURES), command=command, note=note)


def _asked(mesh: TriangleMesh, options: SynthesisOptions, crease: float) -> FloatArray | None:
    # At the triangles' corners (T, 3, 3); None: only the field knows.
    if options.stroke is not None:
        return asked_by_strokes(mesh, options.stroke, crease)
    direction = cast(str | None, options.direction) or default_direction(mesh)
    return asked_at_corners(mesh, parse_direction(direction), crease)


def random_strokes(mesh: TriangleMesh, count: int) -> tuple[str, ...]:
    """Return strokes, as texts, at random places of a mesh, each a random way along it."""
    rng = np.random.default_rng(0)
    triangles = rng.choice(len(mesh.triangles), count, p=mesh.areas / mesh.areas.sum())
    along = np.cross(rng.normal(size=(count, 3)), mesh.flat_normals[triangles])
    places = mesh.corners[triangles].mean(axis=1)
    return tuple(
        ":".join(",".join(map(repr, part)) for part in one)
        for one in np.stack([places, along], axis=1).tolist()
    )


def refined(mesh: TriangleMesh, least: int) -> TriangleMesh:
    """Halve the longest edges of a mesh until it has so many triangles."""
    count = len(mesh.triangles)
    surface = ChartedSurface(mesh, np.zeros(count, np.int32), np.zeros((count, 3, 2)), (), mesh.neighbours)
    vectors = np.tile([1.0, 0.0, 0.0], (count, 3, 1))
    lengths = np.linalg.norm(np.roll(mesh.corners, -1, axis=1) - mesh.corners, axis=2)
    longest = float(np.quantile(lengths, 0.98))
    while len(mesh.triangles) < least:
        longest *= 0.93
        mesh = subdivided(surface, vectors, longest).surface.mesh
    return mesh


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.meshes", description=__doc__)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--sample", type=Path, default=BRICKS)
    parser.add_argument("--texels", type=int)
    parser.add_argument("--block", type=int)
    parser.add_argument("--direction")
    parser.add_argument("--strokes", type=int, default=0)
    parser.add_argument("--crease", type=float)
    parser.add_argument("--refine", type=int)
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    if asked.refine is not None and asked.out is None:
        parser.error("--refine needs -o")
    files = [
        file
        for place in asked.models
        for file in (sorted(place.iterdir()) if place.is_dir() else [place])
        if is_model_name(file.name) and file.suffix.lower() not in CAD_SUFFIXES
    ]
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    if asked.refine is not None:
        for file in files:
            mesh = refined(read_model(file).mesh, asked.refine)
            target = asked.out / f"{file.stem}-{len(mesh.triangles)}.ply"
            write_bare_ply(target, mesh.positions, mesh.triangles)
            print(target)
        return
    options = SynthesisOptions(
        texels=asked.texels, block=asked.block, direction=asked.direction, crease=asked.crease
    )
    rows = []
    for file in files:
        rows.append(measured(file, asked.sample, asked.out, options, asked.strokes))
        print(*asdict(rows[-1]).values(), flush=True)
    table = Table(*(field.name for field in fields(Row)))
    for row in rows:
        table.add_row(*map(str, asdict(row).values()))
    Console(width=220).print(table)
    if asked.publish:
        _publish(rows)
    if asked.out is not None:
        with (asked.out / "meshes.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([field.name for field in fields(Row)])
            writer.writerows(asdict(row).values() for row in rows)


if __name__ == "__main__":
    main()
