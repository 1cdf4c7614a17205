"""Flat sheets of 512² as an eye sees them: ours, a revision's, textbook quilting's and G'MIC's.

``python -m benchmarks eye FOLDER [-o OUT] [--revision REV] [--seeds N] [--only NAME …]``. FOLDER has samples,
128² to 384². With ``--on MODEL …`` ours and the revision cover models instead. OUT gets the sheets; eye.csv
with the figures *broken windows* and *copies*, means of all seeds; pairs/index.html with pairs in random
order without names; and key.csv with the names. What textbook quilting and a revision made is kept.
"""

import argparse
import csv
import os
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.eye_measures import broken_windows, copies
from benchmarks.eye_models import MODELS, broken_on, cover
from benchmarks.eye_pairs import write_pairs
from benchmarks.eye_ways import Way, gmic, revision, textbook, this_checkout
from benchmarks.quilting import BLOCK, OVERLAP
from upholster.image.files.write import IMAGE_SUFFIXES

__all__ = ["main"]

NAMES = ("broken windows", "copies", "near copies")
FLAT = "flat"

Figure = tuple[float, ...]
Figures = dict[tuple[str, str, str], Figure]
"""Those of `NAMES`, of models the first alone, by sample, model and way."""


def options() -> argparse.ArgumentParser:
    """Return the program's options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks eye", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path, default=Path("eye"), help="default: eye")
    parser.add_argument("--revision", metavar="REV", help="another version to compare with: main, HEAD~3")
    parser.add_argument("--python", type=Path, help="its interpreter, instead of a virtual environment made")
    parser.add_argument("--seeds", type=int, default=1, help="sheets of each kind; default 1, figures want 3")
    parser.add_argument("--only", nargs="+", default=(), metavar="NAME", help="some of the samples")
    parser.add_argument("--on", nargs="+", default=(), choices=MODELS, help="models instead of flat sheets")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="has models/: for spot, house and nut")
    parser.add_argument("--pairs", type=int, metavar="N", help="pairs of N samples, drawn at random")
    parser.add_argument("--order", type=int, default=0, metavar="SEED", help="of the pairs' random order")
    parser.add_argument("--block", type=int, default=BLOCK, help="of textbook quilting")
    parser.add_argument("--overlap", type=int, default=OVERLAP, help="of textbook quilting")
    cache = Path(tempfile.gettempdir()) / "upholster-eye"
    parser.add_argument("--cache", type=Path, default=cache, help=f"default: {cache}")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = options()
    asked = parser.parse_args(arguments)
    samples = [
        path.resolve()
        for path in (sorted(asked.folder.iterdir()) if asked.folder.is_dir() else ())
        if path.suffix.lower() in IMAGE_SUFFIXES and (not asked.only or path.stem in asked.only)
    ]
    if not samples:
        parser.error(f"there is no sample in {asked.folder}; allowed: a folder of images")
    out, cache = asked.out.resolve(), asked.cache.resolve()
    try:
        on = {name: MODELS[name].place(asked.data) for name in asked.on}
        ways = [this_checkout(out)]
        ways += [] if on else [textbook(cache, asked.block, asked.overlap)]
        ways += [revision(asked.revision, cache, asked.python)] if asked.revision else []
    except ValueError as error:
        parser.error(str(error))
    other = None if on else gmic(cache)
    ways += [other] if other else []
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    seeds = range(1, asked.seeds + 1)
    with get_context("spawn").Pool(2) as pool:
        for way in ways:
            if not on:
                print(f"sheets: {way.name}", file=sys.stderr, flush=True)
                way.make(samples, seeds, pool)
        shown = on or {FLAT: FLAT}
        jobs = [(s, way, seeds, name, on.get(name, "")) for s in samples for name in shown for way in ways]
        figures = dict(pool.imap(_measured, jobs))
    _write(out, figures)
    _show(figures, [way.name for way in ways])
    every = [(sample, name) for sample in samples for name in shown]
    chosen = np.random.default_rng(asked.order).permutation(len(every))[: asked.pairs].tolist()
    files = {every[n]: {way.name: way.sheet(every[n][0], 1, every[n][1]) for way in ways} for n in chosen}
    page = write_pairs(out, files, [("ours", way.name) for way in ways[1:]], asked.order)
    print(f"wrote {out / 'eye.csv'}, {page}, {out / 'key.csv'}", file=sys.stderr)
    return 0


def _measured(job: tuple[Path, Way, range, str, str]) -> tuple[tuple[str, str, str], Figure]:
    sample, way, seeds, name, on = job
    key = (sample.stem, name, way.name)
    if on:
        return key, (
            float(np.mean([broken_on(cover(way, sample, name, on, n), sample, name) for n in seeds])),
        )
    exemplar = upholster.read_exemplar(sample)
    sheets = [upholster.read_exemplar(way.sheet(sample, seed)) for seed in seeds]
    broken = [broken_windows([sheet], exemplar) for sheet in sheets]
    return key, tuple(float(np.mean(found)) for found in (broken, *zip(*map(copies, sheets), strict=True)))


def _write(out: Path, figures: Figures) -> None:
    with (out / "eye.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sample", "on", "way", *NAMES])
        writer.writerows([*key, *(f"{figure:.4f}" for figure in found)] for key, found in figures.items())


def _show(figures: Figures, ways: Sequence[str]) -> None:
    """Print the first two figures, and how broken windows compare with the second way's, geometrically."""
    rows = list(dict.fromkeys((sample, name) for sample, name, _ in figures))
    values = np.array([[figures[*row, way][:2] for way in ways] for row in rows])
    heads = [f"{way}: {name}" for name in NAMES[: values.shape[2]] for way in ways]
    table = Table("sample", *heads)
    for (sample, name), found in zip(rows, values, strict=True):
        label = sample if name == FLAT else f"{sample} on {name}"
        table.add_row(label, *(f"{figure:.3f}" for figure in found.T.ravel()))
    broken, base = np.maximum(values[:, :, 0], 1e-6), ways[min(1, len(ways) - 1)]
    share = broken / broken[:, [ways.index(base)]]
    share = share[np.isfinite(share).all(axis=1)]
    means = [*np.exp(np.log(share).mean(axis=0)), *values[:, :, 1:].mean(axis=0).ravel()]
    table.add_section()
    table.add_row(f"over {base}'s; means", *(f"{mean:.3f}" for mean in means))
    table.add_row(f"a tenth above {base}'s", *(str(count) for count in (share > 1.1).sum(axis=0)))
    Console(width=30 + 14 * len(heads)).print(table)


if __name__ == "__main__":
    sys.exit(main())
