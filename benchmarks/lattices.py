"""Regular textures on surfaces: how much of a lattice is broken, over samples × surfaces × seeds.

``python -m benchmarks.lattices [FOLDER …] [-o OUT] [--samples NAME …] [--on SURFACE …] [--seeds N]
[--texels N] [--option NAME=VALUE …] [--processes N] [--publish]``, by default generated lattices
(`benchmarks.lattice_samples`) and the project's bricks and weave; of folders the exemplars that have a
lattice, see `benchmarks.fidelity` for how they are read. Besides built-in surfaces there are ``flat``, a
texture of 512², and ``net``, a bent vase, made here. Rows run around the z axis, and level on the bent vase,
unless the options, those of `upholster.SynthesisOptions`, say otherwise. Writes lattices.csv, and a picture
of each sample's first seed to OUT. With several processes, which use a thread each, seconds count for little.
"""

import argparse
import csv
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity import EXAMPLES, exemplars
from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.lattice_samples import PATTERNS, lattice_sample
from benchmarks.measure import Results, one_pixel_a_texel
from benchmarks.tables import write_table
from upholster.elements import Lattice, find_lattice
from upholster.geometry import RationalPatch, Surface, plane, surface_from_spec
from upholster.geometry.face import Face
from upholster.measure import broken_elements, mapping
from upholster.methods import Exemplar, execute, prepare
from upholster.options import SynthesisOptions, WriteOptions
from upholster.parallel import running
from upholster.textured import TexturedModel
from upholster.types import PixelArray

__all__ = ["bent_vase", "lattices", "main"]

FLAT, NET = "flat", "net"
SURFACES = ("torus", "cyclide", "vase", "sphere", NET, FLAT)
OWN = ("bricks", "weave")
SIDE = 256
SHOT = 640


@dataclass(frozen=True)
class Row:
    """Figures of one sample on one surface, with one seed, of the lattice's first and second wave.

    Attributes
    ----------
    broken, broken_2
        Share of the length of all cuts at which the lattice is broken.
    per_area, per_area_2
        Length of such cuts in periods, per square period.
    fault, fault_2
        Length of the longest run of such cuts, in periods.
    within
        Share of the area on which the texture's size is within 5 %.
    """

    sample: str
    surface: str
    seed: int
    broken: float
    broken_2: float | None
    per_area: float
    per_area_2: float | None
    fault: float
    fault_2: float | None
    within: float
    placements: int
    seconds: float


def bent_vase() -> Surface:
    """Return a vase, bent and flattened: a net that no builder makes."""
    faces = []
    for face in surface_from_spec("vase").faces:
        rows = []
        for i in range(face.rows):
            row = []
            for j in range(face.columns):
                net = face.patches[i][j].net
                x, y, z = np.moveaxis(net[..., :3] / net[..., 3:], -1, 0)
                moved = np.stack([1.2 * x + 0.25 * z * z, 0.8 * y + 0.1 * z, z], axis=-1)
                row.append(RationalPatch(np.concatenate([moved * net[..., 3:], net[..., 3:]], axis=-1)))
            rows.append(tuple(row))
        faces.append(Face(tuple(rows)))
    return Surface(faces, "bent vase")


def lattices(results: Results) -> None:
    """Add, for generated lattices and the project's own, the worst figures on each surface."""
    rows = _measure_all(_cases(_samples([], ()), SURFACES, range(1, 3), 2**20, {}), None)
    for spec in SURFACES:
        own = [row for row in rows if row.surface == spec]
        shares = [max(row.broken, row.broken_2 or 0.0) for row in own]
        faults = [max(row.fault, row.fault_2 or 0.0) for row in own]
        worst = f"worst {100 * max(shares):.1f} %"
        results.add(f"lattices, {spec}: broken", 100 * float(np.mean(shares)), "%", remark=worst)
        results.add(f"lattices, {spec}: longest fault", max(faults), "periods", aim="at most 3")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lattices", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--samples", nargs="+", default=(), metavar="NAME")
    parser.add_argument("--on", nargs="+", default=SURFACES, metavar="SURFACE")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--texels", type=int, default=2**20)
    parser.add_argument("--option", nargs="+", default=(), metavar="NAME=VALUE")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    chosen = _samples([folder.resolve() for folder in asked.folders], asked.samples)
    if not chosen:
        parser.error("there is no sample with a lattice")
    options = dict(_option(text) for text in asked.option)
    cases = _cases(chosen, asked.on, range(1, asked.seeds + 1), asked.texels, options)
    rows = _measure_all(cases, asked.out, asked.processes)
    _show(rows)
    if asked.publish:
        _publish(rows)
    if asked.out is not None:
        with (asked.out / "lattices.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(asdict(rows[0])))
            writer.writeheader()
            writer.writerows(asdict(row) for row in rows)
    return 0


def _publish(rows: Sequence[Row]) -> None:
    """Write means over the seeds by sample and surface, and of faults the longest."""
    samples = list(dict.fromkeys(row.sample for row in rows))
    surfaces = list(dict.fromkeys(row.surface for row in rows))
    table = []
    for sample in samples:
        cells = []
        for surface in surfaces:
            own = [row for row in rows if (row.sample, row.surface) == (sample, surface)]
            shares = (_mean(own, field) for field in ("broken", "broken_2"))
            cells.append("; ".join(f"{share:.1%}" for share in shares if share is not None))
        table.append([sample.replace("_", " "), *cells])
    for name, fields, shown, choose in (
        ("longest fault, in periods", ("fault", "fault_2"), "{:.1f}", max),
        ("area where the size is within 5 %, least", ("within",), "{:.1%}", min),
    ):
        values = [
            choose(
                v for field in fields for v in _known([row for row in rows if row.surface == surface], field)
            )
            for surface in surfaces
        ]
        table.append([name, *(shown.format(value) for value in values)])
    seeds = len({row.seed for row in rows})
    command = f"python -m benchmarks lattices --samples {' '.join(samples)} --seeds {seeds} --publish"
    note = "Broken elements by the lattice's first and second wave."
    write_table("lattices", ("sample", *surfaces), table, command=command, note=note)


def _option(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, {"true": True, "false": False}.get(value.lower(), value)


def _samples(folders: Sequence[Path], names: Sequence[str]) -> dict[str, PixelArray]:
    if folders:
        found = {name: sample.exemplar for name, sample in exemplars(folders).items()}
    else:
        found = {name: lattice_sample(name, side=SIDE).image for name in PATTERNS}
        found |= {name: upholster.read_exemplar(EXAMPLES / f"{name}.png", resize=128) for name in OWN}
    return {name: image for name, image in found.items() if not names or name in names}


@dataclass(frozen=True, eq=False)
class Case:
    """A sample that has a lattice, on a surface, with a seed."""

    name: str
    exemplar: PixelArray
    lattice: Lattice
    spec: str
    seed: int
    texels: int
    options: dict[str, Any]
    shown: bool
    threads: int | None = None


def _cases(
    samples: dict[str, PixelArray],
    specs: Sequence[str],
    seeds: Iterable[int],
    texels: int,
    options: dict[str, Any],
) -> list[Case]:
    # Of each sample on each surface the first seed is shown.
    cases = []
    for name, exemplar in samples.items():
        lattice = find_lattice(exemplar)
        if lattice is None:
            print(f"{name}: no lattice", file=sys.stderr)
            continue
        for spec in specs:
            for n, seed in enumerate(seeds):
                cases.append(Case(name, exemplar, lattice, spec, seed, texels, options, n == 0))
    return cases


def _measure_all(cases: Sequence[Case], out: Path | None, processes: int = 1) -> list[Row]:
    rows: list[Row] = []
    tiles: dict[str, list[Tile]] = {
        case.name: [(case.exemplar, [case.name, f"periods {_periods(case.lattice)}"])] for case in cases
    }
    cases = [replace(case, shown=case.shown and out is not None) for case in cases]
    for row, picture in _all_covered(cases, processes):
        rows.append(row)
        print(f"{row.sample}  {'  '.join(_caption(row))}", file=sys.stderr, flush=True)
        if picture is not None:
            tiles[row.sample].append((picture, _caption(row)))
    if out is not None:
        for name, own in tiles.items():
            write_sheet(out / f"{name}.png", own)
    return rows


def _all_covered(cases: Sequence[Case], processes: int) -> Iterator[tuple[Row, PixelArray | None]]:
    if processes == 1:
        yield from map(_covered, cases)
        return
    cases = [replace(case, threads=1) for case in cases]
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        yield from pool.map(_covered, cases)


def _covered(case: Case) -> tuple[Row, PixelArray | None]:
    spec, exemplar = case.spec, case.exemplar
    surface = plane() if spec == FLAT else bent_vase() if spec == NET else surface_from_spec(spec)
    size: dict[str, Any] = {"texels": (512, 512)}
    if spec != FLAT:
        # Around an axis that the bent vase's neck is not on, rows would cross its rim at an angle.
        rows = "level" if spec == NET else "around:z"
        size = one_pixel_a_texel(surface, exemplar, case.texels) | {"direction": rows}
    start = time.perf_counter()
    sample = Exemplar(exemplar)
    scene = prepare(sample, surface, SynthesisOptions(**size | case.options))
    with running(case.threads):
        quilt = execute(scene, sample, surface, seed=case.seed)
    seconds = time.perf_counter() - start
    found = broken_elements(quilt, case.lattice, surface)
    within = 1.0
    if spec != FLAT:
        scale = None if scene.scale is None else scene.scale.scale
        within = mapping(surface, quilt, scale=scale).within
    two = len(found.share) == 2
    row = Row(
        case.name, spec, case.seed,
        found.share[0], found.share[1] if two else None,
        found.per_area[0], found.per_area[1] if two else None,
        found.faults[0], found.faults[1] if two else None,
        within, len(quilt.placements), seconds,
    )  # fmt: skip
    if not case.shown:
        return row, None
    painted = upholster.paint(quilt, exemplar)
    if spec == FLAT:
        return row, painted.arrays[0]
    model = TexturedModel(surface, painted, WriteOptions(size=(SHOT, SHOT)), quilt, exemplar)
    return row, model.picture()


def _periods(lattice: Lattice) -> str:
    return ", ".join(f"{1 / np.hypot(*wave):.1f}" for wave in lattice.waves)


def _caption(row: Row) -> list[str]:
    return [
        f"{row.surface}, seed {row.seed}: broken {_percent(row.broken)}, {_percent(row.broken_2)}",
        f"longest {row.fault:.1f}, {row.fault_2 or 0:.1f} periods, size {_percent(row.within)}, "
        f"{row.seconds:.2f} s",
    ]


def _show(rows: Sequence[Row]) -> None:
    """Print means over the seeds, and of faults the longest."""
    headings = ("sample", "surface", "broken", "2nd", "per area", "2nd", "longest fault", "2nd", "size", "s")
    table = Table(*headings)
    kinds = list(dict.fromkeys((row.sample, row.surface) for row in rows))
    for n, kind in enumerate(kinds):
        own = [row for row in rows if (row.sample, row.surface) == kind]
        table.add_row(
            *kind,
            *(_percent(_mean(own, field)) for field in ("broken", "broken_2")),
            *(_plain(_mean(own, field), 3) for field in ("per_area", "per_area_2")),
            *(_plain(_most(own, field), 1) for field in ("fault", "fault_2")),
            _percent(_mean(own, "within")),
            _plain(_mean(own, "seconds"), 2),
            end_section=kind[0] != [*kinds, ("", "")][n + 1][0],
        )
    Console(width=130).print(table)


def _known(rows: Sequence[Row], field: str) -> list[float]:
    return [value for value in (getattr(row, field) for row in rows) if value is not None]


def _mean(rows: Sequence[Row], field: str) -> float | None:
    values = _known(rows, field)
    return float(np.mean(values)) if values else None


def _most(rows: Sequence[Row], field: str) -> float | None:
    return max(_known(rows, field), default=None)


def _percent(value: float | None) -> str:
    return "none" if value is None else f"{100 * value:.1f} %"


def _plain(value: float | None, digits: int) -> str:
    return "none" if value is None else f"{value:.{digits}f}"


if __name__ == "__main__":
    sys.exit(main())
