"""What refinement brings: flat textures as they are laid, ``--effort 0``, against refined ones; and tiles.

``python -m benchmarks.refinement [FOLDER …] [-o OUT] [--seeds N] [--effort N] [--side N]``, by default on the
project's examples, effort 1, textures of 512² and tiles of three quarters of their side; see
`benchmarks.fidelity` for how exemplars are read. Writes refinement.csv, and a sheet per exemplar, to OUT.

*Cut energy* is what the cuts cost: over all pairs of neighbouring texels that different blocks show, what the
two blocks differ by at both texels (principal components of 8 bits), for a texel of the texture. *Cut ratio*
is `upholster.measure.matched_cut_ratio`. *Patches* are distances to the nearest ones of the sample, at 15²
and 31², and at 31² of the sample's to the result's. *Tile edges*: what shows at cuts within an eighth of the
tile's side from its edges, round which it goes on, over the same elsewhere.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import upholster
from benchmarks.fidelity import EXAMPLES, exemplars
from benchmarks.fidelity_sheet import write_sheet
from benchmarks.measure import Results
from upholster.geometry import plane
from upholster.measure import matched_cut_ratio
from upholster.measure.fidelity import sliced_wasserstein
from upholster.measure.patch_distance import patch_distance
from upholster.measure.trace import step_sources
from upholster.methods.quilt.features import pca_features
from upholster.quilt import Quilt, Texels
from upholster.types import FloatArray, PixelArray

__all__ = ["Refined", "main", "refinement"]

Index = NDArray[np.integer[Any]]


@dataclass(frozen=True)
class Refined:
    """Figures of one texture; of each, less is better but of the cut ratio, where 1 is the sample's own."""

    cut_energy: float
    cut_ratio: float
    swd: float
    patches_15: float
    patches_31: float
    left_out_31: float
    tile_edges: float


def refinement(results: Results) -> None:
    """Add, for the project's examples, by how much refinement changes each figure in the mean."""
    found = measured([EXAMPLES], (0, 1), seeds=1, side=512, out=None)
    for name, change in _changes(found).items():
        results.add(f"refinement: {name} with effort 1 over effort 0, mean", change, "times")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.refinement", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, default=[EXAMPLES], metavar="FOLDER")
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--effort", type=int, default=1)
    parser.add_argument("--side", type=int, default=512)
    asked = parser.parse_args(arguments)
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
    folders = [folder.resolve() for folder in asked.folders]
    found = measured(folders, (0, asked.effort), seeds=asked.seeds, side=asked.side, out=asked.out)
    if not found:
        parser.error("there is no image in the folders")
    _show(found)
    if asked.out is not None:
        _write(asked.out / "refinement.csv", found)
    return 0


def measured(
    folders: Sequence[Path], efforts: tuple[int, int], *, seeds: int, side: int, out: Path | None
) -> dict[str, tuple[Refined, Refined]]:
    """Return the means over seeds for each exemplar, with either effort."""
    found = {}
    for name, sample in exemplars(folders).items():
        exemplar, tiles, means = sample.exemplar, [], []
        for effort in efforts:
            made = [_made(exemplar, effort, seed, side) for seed in range(1, seeds + 1)]
            means.append(_mean([one for one, _ in made]))
            figures = _line(means[-1]).split(", ")
            tiles.append(
                (made[0][1], [f"{name}, effort {effort}", ", ".join(figures[:4]), ", ".join(figures[4:])])
            )
        found[name] = (means[0], means[1])
        print(f"{name}: {_line(means[0])}; refined: {_line(means[1])}", file=sys.stderr, flush=True)
        if out is not None:
            write_sheet(out / f"{name}.png", tiles, columns=2)
    return found


def _made(exemplar: PixelArray, effort: int, seed: int, side: int) -> tuple[Refined, PixelArray]:
    quilt = upholster.synthesize(exemplar, plane(), texels=(side, side), effort=effort, seed=seed)
    picture = upholster.paint(quilt, exemplar).arrays[0]
    small, large = (patch_distance([picture], exemplar, side=patch) for patch in (15, 31))
    tile = upholster.synthesize(
        exemplar, plane(), texels=(side * 3 // 4, side * 3 // 4), tileable=True, effort=effort, seed=seed
    )
    nothing = float("nan")
    ratio = matched_cut_ratio(quilt, Texels(quilt.charts, (picture,)), exemplar)
    return Refined(
        cut_energy(quilt, exemplar),
        nothing if ratio is None else ratio,
        1000 * float(np.mean(sliced_wasserstein([picture], exemplar))),
        nothing if small is None else small.to_sample,
        nothing if large is None else large.to_sample,
        nothing if large is None else large.to_result,
        tile_edges(tile, upholster.paint(tile, exemplar).arrays[0]),
    ), picture


def cut_energy(quilt: Quilt, exemplar: PixelArray) -> float:
    """Return what the cuts of a flat quilt cost, for a texel: see the module."""
    form, _ = pca_features(exemplar)
    image = form.astype(np.float64).reshape(*exemplar.shape[:2], -1)
    chart, placed = quilt.charts[0], quilt.placements
    owners = quilt.owners(0, 0, 0, chart.height, chart.width)
    total, read = 0.0, partial(_read, quilt, image, placed)
    for down, right in ((1, 0), (0, 1)):
        one, other = owners[: chart.height - down, : chart.width - right], owners[down:, right:]
        rows, columns = np.nonzero(one != other)
        first, second = one[rows, columns], other[rows, columns]
        for r, c in ((rows, columns), (rows + down, columns + right)):
            apart = read(first, r, c) - read(second, r, c)
            total += float(np.sqrt((apart**2).sum(axis=1)).sum())
    return total / (chart.height * chart.width)


def _read(
    quilt: Quilt, image: FloatArray, placed: NDArray[np.void], blocks: Index, rows: Index, columns: Index
) -> FloatArray:
    # What blocks have at texels of a flat texture.
    place = (step_sources(quilt.fields[0], placed[blocks], rows, columns) + 8) >> 4
    y, x = (np.clip(part, 0, size - 1) for part, size in zip(place, image.shape, strict=False))
    found: FloatArray = image[y, x]
    return found


def tile_edges(tile: Quilt, picture: PixelArray) -> float:
    """Return what shows at cuts near a tile's edges over the same elsewhere: see the module."""
    sources, near, elsewhere = tile.sources()[0].astype(np.int64), 0.0, 0.0
    for axis in (0, 1):
        step = np.array([16 * (axis == 0), 16 * (axis == 1)])
        broken = (np.roll(sources, -1, axis) - sources != step).any(axis=2)
        apart = np.abs(np.roll(picture, -1, axis).astype(np.float64) - picture).mean(axis=2)
        lines = np.moveaxis(broken * apart, axis, 0).mean(axis=1)
        eighth = len(lines) // 8
        near += float(np.r_[lines[:eighth], lines[-eighth:]].mean())
        elsewhere += float(lines[eighth:-eighth].mean())
    return near / elsewhere if elsewhere else float("nan")


def _mean(made: Sequence[Refined]) -> Refined:
    return Refined(*(float(np.mean([getattr(one, part.name) for one in made])) for part in fields(Refined)))


def _changes(found: dict[str, tuple[Refined, Refined]]) -> dict[str, float]:
    # Figures refined over figures as laid, the mean over exemplars.
    return {
        part.name.replace("_", " "): float(
            np.nanmean(
                [getattr(after, part.name) / getattr(before, part.name) for before, after in found.values()]
            )
        )
        for part in fields(Refined)
    }


def _line(one: Refined) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {value:.3g}" for name, value in asdict(one).items())


def _show(found: dict[str, tuple[Refined, Refined]]) -> None:
    names = [part.name for part in fields(Refined)]
    table = Table("as laid, refined", *(name.replace("_", " ") for name in names))
    for exemplar, (before, after) in found.items():
        cells = [f"{getattr(before, name):.3g}, {getattr(after, name):.3g}" for name in names]
        table.add_row(exemplar, *cells)
    table.add_row("refined over laid, mean", *(f"{change:.3f}" for change in _changes(found).values()))
    worst = [
        max(getattr(after, name) / getattr(before, name) for before, after in found.values())
        for name in names
    ]
    table.add_row("the same, greatest", *(f"{change:.3f}" for change in worst))
    Console(width=150).print(table)


def _write(path: Path, found: dict[str, tuple[Refined, Refined]]) -> None:
    names = [part.name for part in fields(Refined)]
    lines = [",".join(["exemplar", "refined", *names])]
    for exemplar, pair in found.items():
        for refined, one in enumerate(pair):
            lines.append(",".join([exemplar, str(refined), *(f"{getattr(one, name):.5g}" for name in names)]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
