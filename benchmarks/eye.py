"""Flat sheets of 512² as an eye sees them: ours, a revision's, textbook quilting's and G'MIC's.

``python -m benchmarks eye FOLDER [-o OUT] [--revision REV] [--seeds N] [--only NAME …]``. FOLDER has samples,
128² to 384². OUT gets the sheets, eye.csv with the figures *broken windows* and *copies*, means of all seeds
(docs/measures.md), pairs/index.html with pairs in random order without names, and key.csv with the names.
What textbook quilting and a revision made is kept in the cache.
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
from benchmarks.eye_pairs import write_pairs
from benchmarks.eye_ways import Way, gmic, revision, textbook, this_checkout
from benchmarks.quilting import BLOCK, OVERLAP
from upholster.image import IMAGE_SUFFIXES

__all__ = ["main"]

Figures = dict[tuple[str, str], tuple[float, float, float]]
"""Broken windows, copies, near copies, by sample and way."""

NAMES = ("broken windows", "copies", "near copies")


def options() -> argparse.ArgumentParser:
    """Return the program's options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks eye", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path, default=Path("eye"), help="default: eye")
    parser.add_argument("--revision", metavar="REV", help="another version to compare with: main, HEAD~3")
    parser.add_argument("--python", type=Path, help="its interpreter, instead of a virtual environment made")
    parser.add_argument("--seeds", type=int, default=1, help="sheets of each kind; default 1, figures want 3")
    parser.add_argument("--only", nargs="+", default=(), metavar="NAME", help="some of the samples")
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
        ways = [this_checkout(out), textbook(cache, asked.block, asked.overlap)]
        ways += [revision(asked.revision, cache, asked.python)] if asked.revision else []
    except ValueError as error:
        parser.error(str(error))
    other = gmic(cache)
    ways += [other] if other else []
    seeds = range(1, asked.seeds + 1)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with get_context("spawn").Pool(2) as pool:
        for way in ways:
            print(f"sheets: {way.name}", file=sys.stderr, flush=True)
            way.make(samples, seeds, pool)
        jobs = [(sample, way, seeds) for sample in samples for way in ways]
        figures = dict(pool.imap(_measured, jobs))
    _write(out, figures)
    _show(figures, [way.name for way in ways])
    chosen = np.random.default_rng(asked.order).permutation(samples)[: asked.pairs].tolist()
    sheets = {str(sample): {way.name: way.sheet(sample, 1) for way in ways} for sample in map(Path, chosen)}
    page = write_pairs(out, sheets, [("ours", way.name) for way in ways[1:]], asked.order)
    print(f"wrote {out / 'eye.csv'}, {page}, {out / 'key.csv'}", file=sys.stderr)
    return 0


def _measured(job: tuple[Path, Way, range]) -> tuple[tuple[str, str], tuple[float, float, float]]:
    sample, way, seeds = job
    exemplar = upholster.read_exemplar(sample)
    sheets = [upholster.read_exemplar(way.sheet(sample, seed)) for seed in seeds]
    broken = [broken_windows([sheet], exemplar) for sheet in sheets]
    means = [float(np.mean(found)) for found in (broken, *zip(*map(copies, sheets), strict=True))]
    return (sample.stem, way.name), (means[0], means[1], means[2])


def _write(out: Path, figures: Figures) -> None:
    with (out / "eye.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sample", "way", *NAMES])
        writer.writerows([*key, *(f"{figure:.4f}" for figure in found)] for key, found in figures.items())


def _show(figures: Figures, ways: Sequence[str]) -> None:
    """Print figures side by side, and how broken windows compare with textbook's in the geometric mean."""
    table = Table("sample", *(f"{way}: broken" for way in ways), *(f"{way}: copies" for way in ways))
    samples = list(dict.fromkeys(sample for sample, _ in figures))
    for sample in samples:
        table.add_row(sample, *(f"{figures[sample, way][k]:.3f}" for k in (0, 2) for way in ways))
    broken = np.array([[figures[sample, way][0] for way in ways] for sample in samples])
    near = np.array([[figures[sample, way][2] for way in ways] for sample in samples])
    share = broken / broken[:, ways.index("textbook")][:, None]
    table.add_section()
    table.add_row(
        "over textbook's",
        *(f"{mean:.3f}" for mean in np.exp(np.log(np.maximum(share, 1e-6)).mean(axis=0))),
        *(f"{mean:.3f}" for mean in near.mean(axis=0)),
    )
    table.add_row("a tenth worse on", *(str(count) for count in (share > 1.1).sum(axis=0)))
    Console(width=max(80, 14 * (1 + 2 * len(ways)))).print(table)


if __name__ == "__main__":
    sys.exit(main())
