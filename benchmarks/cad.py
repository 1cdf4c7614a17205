"""CAD files covered: what they hold, areas beside Open CASCADE's own, time, charts, seams and scale.

``python -m benchmarks.cad FOLDER|FILE … [-o OUT] [--sample IMAGE] [--texels N] [--publish]``. Prints a
table in Markdown; writes cad.csv and a picture of each to OUT. Source and licence are taken from the table
in the folder's README.md, where there is one. A file that can not be covered is reported by name, and
the rest goes on.
"""

import argparse
import csv
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from benchmarks.meshes import BRICKS, COLUMNS, measured, spread_over
from benchmarks.tables import write_table
from upholster.cli.console import large_count
from upholster.errors import UpholsterError
from upholster.formats import CAD_SUFFIXES
from upholster.geometry.cad import exact_body
from upholster.occt.process import read_cad
from upholster.options import SynthesisOptions

__all__ = ["CadRow", "cad_row", "main"]


@dataclass(frozen=True)
class CadRow:
    """Figures of one file.

    Attributes
    ----------
    faces, patches, plain
        How many faces, rational Bézier patches, and faces without triangles.
    area_off
        Our area over Open CASCADE's, less 1, in percent: of the patches, over the triangles in parameters;
        without plain faces.
    worst_off
        Of all faces larger than a thousandth of the model the one that is farthest off, in percent.
    seconds, cpu
        To read, lay out, cover and paint it; and of the processors' time, all threads and processes together,
        which is much the same on a busy machine.
    smooth, bent
        Seam ratio where faces meet smoothly, within 5°, and over seams at which the surface turns by more,
        but less than a crease. 0 where there are none.
    within, spread
        Share of the area with the right size within 5 %; 99th over 1st percentile of the density of texels.
    """

    file: str
    source: str = ""
    licence: str = ""
    faces: int = 0
    patches: int = 0
    plain: int = 0
    triangles: int = 0
    charts: int = 0
    area_off: float = 0.0
    worst_off: float = 0.0
    seconds: float = 0.0
    cpu: float = 0.0
    smooth: float = 0.0
    bent: float = 0.0
    within: float = 0.0
    spread: float = 0.0
    said: str = ""

    @property
    def off(self) -> float:
        """Return how far the areas are off, in percent."""
        return abs(self.area_off)


def cad_row(
    file: Path, sources: dict[str, tuple[str, str]], sample: Path, out: Path | None, options: SynthesisOptions
) -> CadRow:
    """Read a file, cover it and measure it."""
    source, licence = sources.get(file.name, ("", ""))
    try:
        record = read_cad(file)
    except UpholsterError as error:
        return CadRow(file.name, source, licence, said=str(error))
    pairs = [
        (face.area, area, exact)
        for body in record.bodies
        for found in [exact_body(body, record.deviation)]
        for face, area, exact in zip(body.faces, found.areas, found.faces, strict=True)
        if not face.plain
    ]
    theirs = sum(wanted for wanted, _, _ in pairs)
    large = [abs(area / wanted - 1) for wanted, area, _ in pairs if wanted > 1e-3 * theirs]
    start = sum(os.times()[:4])
    row = measured(file, sample, out, options)
    cpu = sum(os.times()[:4]) - start
    return CadRow(
        file.name,
        source,
        licence,
        faces=sum(len(body.faces) for body in record.bodies),
        patches=sum(exact.patches for _, _, exact in pairs if exact is not None),
        plain=sum(bool(face.plain) for body in record.bodies for face in body.faces),
        triangles=row.triangles,
        charts=row.charts,
        area_off=round(100 * (sum(area for _, area, _ in pairs) / theirs - 1), 4),
        worst_off=round(100 * max(large, default=0.0), 3),
        seconds=round(row.read + row.prepare + row.synthesize + row.paint, 1),
        cpu=round(cpu, 1),
        smooth=row.smooth,
        bent=row.bent,
        within=row.within,
        spread=row.spread,
        said=row.said if not row.triangles else "",
    )


MEASURES = {
    "area off Open CASCADE's, in %, without its sign": ("off", "{:.3f}", max),
    "seams where faces meet smoothly": ("smooth", "{:.2f}", max),
    "seams where they bend, up to 75°": ("bent", "{:.2f}", max),
    "area where the size is within 5 %": ("within", "{:.1%}", min),
    "processor seconds, from file to texels": ("cpu", "{:.0f}", max),
}
"""Rows of the table, as in `benchmarks.meshes`."""


def _publish(rows: Sequence[CadRow], texels: int | None) -> None:
    covered = [row for row in rows if row.triangles]
    faces, plain = sum(row.faces for row in covered), sum(row.plain for row in covered)
    note = f"{len(covered)} files, `bricks.png`; {plain} of {faces:,} faces could not be covered."
    command = f"python -m benchmarks.cad FOLDER{f' --texels {texels}' if texels else ''} --publish"
    write_table("cad", COLUMNS, spread_over(covered, "file", MEASURES), command=command, note=note)


def _sources(folder: Path) -> dict[str, tuple[str, str]]:
    """Return source and licence by file from the table in a folder's README.md."""
    readme = folder / "README.md"
    rows = readme.read_text(encoding="utf-8").splitlines() if readme.is_file() else []
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows if row.startswith("|")]
    return {row[0]: (row[1], row[2].partition(" (")[0]) for row in cells if len(row) > 3}


def _markdown(rows: Sequence[CadRow]) -> list[str]:
    names = [field.name for field in fields(CadRow) if field.name != "said"]
    lines = [f"| {' | '.join(names)} |", f"|{' --- |' * len(names)}"]
    for row in rows:
        values = asdict(row)
        if row.said:
            lines.append(
                f"| {row.file} | {row.source} | {row.licence} | {row.said} |{' |' * (len(names) - 4)}"
            )
        else:
            lines.append(f"| {' | '.join(str(values[name]) for name in names)} |")
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cad", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--sample", type=Path, default=BRICKS)
    parser.add_argument("--texels", type=lambda text: large_count("texels", text))
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    options = SynthesisOptions(texels=asked.texels)
    rows = []
    for place in asked.files:
        sources = _sources(place if place.is_dir() else place.parent)
        for file in sorted(place.iterdir()) if place.is_dir() else [place]:
            if file.suffix.lower() in CAD_SUFFIXES:
                rows.append(cad_row(file, sources, asked.sample, asked.out, options))
                print(*asdict(rows[-1]).values(), flush=True)
    print(*_markdown(rows), sep="\n")
    if asked.publish:
        _publish(rows, asked.texels)
    if asked.out is not None:
        with (asked.out / "cad.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([field.name for field in fields(CadRow)])
            writer.writerows(asdict(row).values() for row in rows)


if __name__ == "__main__":
    main()
