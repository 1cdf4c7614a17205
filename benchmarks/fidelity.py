"""Flat results against their exemplars, 128² → 512²: our methods, G'MIC and resynthesizer.

``python -m benchmarks.fidelity [FOLDER …] [-o OUT] [--seeds N] [--only METHOD …] [--publish]``, by default
on the project's examples. Files of other folders are reduced to 256² and cut to their upper left quarter;
the examples are reduced to 128². Seconds are processor seconds. A name's first part is its class: regular,
near_regular, irregular, stochastic. Writes fidelity.json, fidelity.csv and a contact sheet per exemplar to
OUT. Portilla–Simoncelli errors and resynthesizer need the extra ``fidelity``; what is not installed is left
out with a message.

Row "real" is the texture itself, the whole 256² against its quarter, outside the ranking: what two samples of
one texture differ by. Differences between methods that are smaller than that say little.
"""

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity_measures import JUDGED, Judgement, judge
from benchmarks.fidelity_methods import Made, methods, versions
from benchmarks.fidelity_sheet import Tile, write_sheet
from benchmarks.measure import EXEMPLAR, Results, median_seconds, processor_seconds
from benchmarks.tables import write_table
from upholster.image import IMAGE_SUFFIXES
from upholster.measure import measure_cover
from upholster.types import PixelArray

__all__ = ["exemplars", "fidelity", "main"]

EXAMPLES = EXEMPLAR.parent
SIDE = 128
CLASSES = {
    "brick": "regular",
    "bricks": "regular",
    "weave": "regular",
    "granite": "stochastic",
    "grass": "stochastic",
    "gravel": "stochastic",
    "pebbles": "irregular",
}

Found = dict[str, dict[str, list[Judgement]]]
"""Judgements by exemplar, method and seed."""


REAL = "real"
LABELS = {"quilt": "`upholster`", "paper": "`upholster --method paper`", REAL: "another piece of the photo"}


@dataclass(frozen=True)
class Sample:
    """An exemplar of 128², and 256² of the same texture, if there is more than the exemplar."""

    exemplar: PixelArray
    more: PixelArray | None = None


def exemplars(folders: Sequence[Path]) -> dict[str, Sample]:
    """Return the exemplars of some folders by name."""
    found = {}
    for folder in folders:
        for path in sorted(folder.iterdir()):
            if path.suffix.lower() not in IMAGE_SUFFIXES:
                continue
            if folder == EXAMPLES:
                found[path.stem] = Sample(upholster.read_exemplar(path, resize=(SIDE, SIDE)))
            else:
                halved = upholster.read_exemplar(path, resize=(2 * SIDE, 2 * SIDE))
                found[path.stem] = Sample(np.ascontiguousarray(halved[:SIDE, :SIDE]), halved)
    return found


def fidelity(results: Results, folders: Sequence[Path] = (EXAMPLES,)) -> None:
    """Add mean figures per method; and time the measuring itself, on F1."""
    _time(results)
    found = _judge_all(exemplars(folders), range(1, 4), only=(), out=None)
    for method, summary in _summary(found).items():
        for name, figure in summary.items():
            if figure is not None:
                results.add(f"fidelity, {len(found)} exemplars, {method}: {name}", figure, "")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fidelity", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", nargs="+", default=(), metavar="METHOD")
    parser.add_argument("--publish", action="store_true", help="write the table of docs/benchmarks.md")
    asked = parser.parse_args(arguments)
    chosen = exemplars([folder.resolve() for folder in asked.folders])
    if not chosen:
        parser.error("there is no image in the folders")
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    found = _judge_all(chosen, range(1, asked.seeds + 1), only=asked.only, out=asked.out)
    _show(found)
    if asked.publish:
        _publish(found, asked.seeds)
    if asked.out is not None:
        _write(asked.out, found)
    return 0


def _judge_all(
    chosen: dict[str, Sample], seeds: Iterable[int], *, only: Sequence[str], out: Path | None
) -> Found:
    here, missing = methods()
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}", file=sys.stderr)
    found: Found = defaultdict(dict)
    warm = next(iter(chosen.values())).exemplar
    for method in ("quilt", "paper"):  # kernels are compiled, or read, at their first call
        if method in here:
            here[method](warm, 0)
    for name, sample in chosen.items():
        exemplar = sample.exemplar
        tiles: list[Tile] = [(exemplar, [name, _class(name)])]
        if sample.more is not None:
            found[name][REAL] = [judge(Made(sample.more), exemplar, 0.0)]
            tiles.append((sample.more, _caption(REAL, found[name][REAL])))
        for method, make in here.items():
            if only and method not in only:
                continue
            made: list[Made] = []
            judged = []
            for seed in seeds:
                start = processor_seconds()
                made.append(make(exemplar, seed))
                judged.append(judge(made[-1], exemplar, processor_seconds() - start))
            found[name][method] = judged
            tiles.append((made[0].image, _caption(method, judged)))
            print(f"{name}: {'  '.join(tiles[-1][1])}", file=sys.stderr, flush=True)
        if out is not None:
            write_sheet(out / f"{name}.png", tiles)
    return dict(found)


def _caption(method: str, judged: Sequence[Judgement]) -> list[str]:
    ps, swd, structure, copied, cuts, seconds = (
        _mean(judged, field) for field in ("ps", "swd", "structure", "copy_ratio", "cuts", "seconds")
    )
    lines = [f"{method}: PS {_figure(ps)}, SWD {_figure(swd, 1000)}e-3, structure {_figure(structure)}"]
    lines.append(f"copied {_figure(copied)}, cuts {_figure(cuts)}, {seconds or 0:.2f} s")
    return [line.replace("–", "none") for line in lines]  # the sheets' font has no dash


def _summary(found: Found) -> dict[str, dict[str, float | None]]:
    """Return each method's means over all exemplars, its rank sum, and how often it is first."""
    names = list(dict.fromkeys(method for by_method in found.values() for method in by_method))
    summary: dict[str, dict[str, float | None]] = {}
    ranks = {exemplar: _rank_sums(by_method) for exemplar, by_method in found.items()}
    for method in names:
        judged = [entry for by_method in found.values() for entry in by_method.get(method, [])]
        row: dict[str, float | None] = {
            "PS error": _mean(judged, "ps"),
            "SWD, 1e-3": _scaled(_mean(judged, "swd"), 1000),
            "structure lost": _mean(judged, "structure"),
            "copy ratio": _mean(judged, "copy_ratio"),
            "longest repeat": _mean(judged, "longest"),
            "cuts, matched": _mean(judged, "cuts"),
            "seconds": _mean(judged, "seconds"),
            "rank sum": sum(sums.get(method, 0.0) for sums in ranks.values()),
            "first": sum(sums.get(method) == min(sums.values()) for sums in ranks.values()),
        }
        summary[method] = row
    return summary


def _rank_sums(by_method: dict[str, list[Judgement]]) -> dict[str, float]:
    """Return the sum of the ranks by every measure that applies; equal figures share their ranks' mean."""
    ranked = {method: judged for method, judged in by_method.items() if method != REAL}
    sums = dict.fromkeys(ranked, 0.0)
    for field in JUDGED:
        figures = {method: _mean(judged, field) for method, judged in ranked.items()}
        known = {method: figure for method, figure in figures.items() if figure is not None}
        for method, figure in known.items():
            better = sum(other < figure for other in known.values())
            equal = sum(other == figure for other in known.values())
            sums[method] += better + (equal + 1) / 2
    return sums


def _show(found: Found) -> None:
    console = Console(width=150)
    each = Table("exemplar", "class", "method", "PS error", "SWD, 1e-3", "structure", "cuts", "s", "ranks")
    for name, by_method in found.items():
        ranks = _rank_sums(by_method)
        for method, judged in by_method.items():
            ps, swd, structure, cuts, seconds = (
                _mean(judged, field) for field in ("ps", "swd", "structure", "cuts", "seconds")
            )
            figures = [_figure(ps), _figure(swd, 1000), _figure(structure), _figure(cuts), _figure(seconds)]
            each.add_row(name, _class(name), method, *figures, f"{ranks.get(method, 0):g}")
    console.print(each)
    summary = _summary(found)
    headings = list(next(iter(summary.values())))
    whole = Table(f"{len(found)} exemplars", *headings)
    for method, row in summary.items():
        whole.add_row(method, *(_figure(row[heading]) for heading in headings))
    console.print(whole)


def _publish(found: Found, seeds: int) -> None:
    """Write each method's means; the row of the texture itself is last."""
    summary = _summary(found)
    rows = []
    for method in sorted(summary, key=lambda method: method == REAL):
        row, real = summary[method], method == REAL
        figures = [_figure(row[name]) for name in ("PS error", "SWD, 1e-3", "structure lost")]
        first = "" if real else f"{row['first']:.0f} of {len(found)}"
        seconds = "" if real else f"{row['seconds']:.2f} s"
        rows.append([LABELS.get(method, method), *figures, seconds, first])
    columns = (
        "program", "Portilla–Simoncelli error", "sliced Wasserstein, 10⁻³", "structure lost",
        "processor time", "first by rank",
    )  # fmt: skip
    command = f"python -m benchmarks fidelity FOLDER --seeds {seeds} --publish"
    note = "Lower is better. Rank: the sum of the ranks by the three measures; ties count for both."
    write_table(
        "fidelity", columns, rows, command=command, peers=versions("G'MIC", "resynthesizer"), note=note
    )


def _write(out: Path, found: Found) -> None:
    plain: dict[str, Any] = {
        "summary": _summary(found),
        "exemplars": {
            name: {method: [entry.to_json() for entry in judged] for method, judged in by_method.items()}
            for name, by_method in found.items()
        },
    }
    (out / "fidelity.json").write_text(json.dumps(plain, indent=2) + "\n", encoding="utf-8")
    lines = ["exemplar,class,method,ps,swd,structure,copy_ratio,longest,cuts,seconds"]
    for name, by_method in found.items():
        for method, judged in by_method.items():
            fields = ("ps", "swd", "structure", "copy_ratio", "longest", "cuts", "seconds")
            values = [_mean(judged, field) for field in fields]
            figures = ["" if value is None else f"{value:.5g}" for value in values]
            lines.append(",".join([name, _class(name), method, *figures]))
    (out / "fidelity.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _class(name: str) -> str:
    for known in ("near_regular", "irregular", "regular", "stochastic"):
        if name.startswith(known):
            return known
    return CLASSES.get(name, "")


def _mean(judged: Sequence[Judgement], field: str) -> float | None:
    values = [value for entry in judged if (value := getattr(entry, field)) is not None]
    return float(np.mean(values)) if values else None


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _figure(value: float | None, factor: float = 1.0) -> str:
    return "–" if value is None else f"{factor * value:.3f}"


def _time(results: Results) -> None:
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, method="paper", seed=7)
    texels = upholster.paint(quilt, exemplar)
    seconds = median_seconds(lambda: measure_cover(surface, quilt, exemplar, texels=texels), runs=3)
    results.add("all measures of F1", seconds, "s", aim="at most 5")


if __name__ == "__main__":
    sys.exit(main())
