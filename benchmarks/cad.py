"""CAD files covered: areas beside Open CASCADE's own, processor time, seams and sizes, over files.

A file that can not be covered is reported by name, and the rest goes on.
"""

import os
import sys
from dataclasses import astuple, dataclass
from pathlib import Path

from benchmarks.measure import Request
from benchmarks.meshes import COLUMNS, covered, spread_over
from benchmarks.tables import Table
from upholster.base.errors import UpholsterError
from upholster.base.formats import CAD_SUFFIXES
from upholster.geometry.cad.exact_body import exact_body
from upholster.geometry.occt.process import read_cad

__all__ = ["measured"]


@dataclass(frozen=True)
class Row:
    """Figures of one file, 0 where there are none; without triangles `said` tells why.

    Attributes
    ----------
    faces, plain
        How many faces, and how many without triangles.
    off
        By how much our area is off Open CASCADE's, in percent: of the patches, over the triangles in
        parameters; without plain faces.
    cpu
        Processor seconds to read, lay out, cover and paint it, all threads and processes together.
    smooth, bent, within
        As of `benchmarks.meshes`.
    """

    file: str
    faces: int = 0
    plain: int = 0
    triangles: int = 0
    off: float = 0.0
    cpu: float = 0.0
    smooth: float = 0.0
    bent: float = 0.0
    within: float = 0.0
    said: str = ""


MEASURES = {
    "area off Open CASCADE's, in %, without its sign": ("off", "{:.3f}", max),
    "seams where faces meet smoothly": ("smooth", "{:.2f}", max),
    "seams where they bend, up to 75°": ("bent", "{:.2f}", max),
    "area where the size is within 5 %": ("within", "{:.1%}", min),
    "processor seconds, from file to texels": ("cpu", "{:.0f}", max),
}
"""Rows of the table, as in `benchmarks.meshes`."""


def measured(request: Request) -> Table:
    """Return median, mean and worst over the files."""
    rows = []
    for file in request.listed(CAD_SUFFIXES):
        rows.append(_covered(file, request.texels))
        print(*astuple(rows[-1]), file=sys.stderr, flush=True)
    whole = [row for row in rows if row.triangles]
    faces, plain = sum(row.faces for row in whole), sum(row.plain for row in whole)
    note = f"{len(whole)} files, `bricks.png`; {plain} of {faces:,} faces could not be covered."
    return Table(COLUMNS, spread_over(whole, "file", MEASURES), {"note": note})


def _covered(file: Path, texels: int | None) -> Row:
    try:
        record = read_cad(file)
    except UpholsterError as error:
        return Row(file.name, said=str(error))
    pairs = [
        (face.area, area)
        for body in record.bodies
        for face, area in zip(body.faces, exact_body(body, record.deviation).areas, strict=True)
        if not face.plain
    ]
    theirs, ours = (sum(areas) for areas in zip(*pairs, strict=True))
    start = sum(os.times()[:4])
    row = covered(file, texels)
    return Row(
        file.name,
        sum(len(body.faces) for body in record.bodies),
        sum(bool(face.plain) for body in record.bodies for face in body.faces),
        row.triangles,
        round(100 * abs(ours / theirs - 1), 4),
        round(sum(os.times()[:4]) - start, 1),
        row.smooth,
        row.bent,
        row.within,
        row.said,
    )
