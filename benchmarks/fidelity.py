"""Flat results against their samples, 128² → 512²: our methods, G'MIC and resynthesizer.

Row "another piece of the photo" is the texture itself, 256² against its own quarter, outside the ranking:
what two samples of one texture differ by. Portilla–Simoncelli errors and resynthesizer need the extra
``fidelity``; what is not installed is left out with a message. Seconds are processor seconds. With ``-o``
there is a contact sheet of each sample.
"""

import sys
import warnings
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.contact_sheet import Tile, write_sheet
from benchmarks.measure import Request, processor_seconds, samples
from benchmarks.peers import methods, versions
from benchmarks.tables import Table
from upholster.base.types import PixelArray
from upholster.covering.measure import sliced_wasserstein
from upholster.covering.measure.samples import coded

__all__ = ["measured", "statistics_error"]

JUDGED = ("ps", "swd")
"""Methods are ranked by these; smaller is better."""

REAL = "another piece of the photo"
LABELS = {"quilt": "`upholster`", "paper": "`upholster --method paper`"}
GREY = np.array([0.299, 0.587, 0.114])


@dataclass(frozen=True)
class Judgement:
    """Portilla–Simoncelli error, None if it is not known; sliced Wasserstein distance; seconds."""

    ps: float | None
    swd: float
    seconds: float = 0.0


def measured(request: Request) -> Table:
    """Return means over all samples and seeds; ranks are sums over the measures, and ties count for both."""
    found: dict[str, dict[str, list[Judgement]]] = defaultdict(dict)
    here = methods()
    for name, (exemplar, picture) in samples(request).items():
        if not found:  # kernels are compiled, or read, at their first call
            here["quilt"](exemplar, 0), here["paper"](exemplar, 0)
        tiles: list[Tile] = [(exemplar, [name])]
        if picture is not None:
            found[name][REAL] = [_judged(picture, exemplar)]
        for method, make in here.items():
            judged = []
            for seed in range(1, request.seeds + 1):
                start = processor_seconds()
                made = make(exemplar, seed)
                judged.append(_judged(made, exemplar, processor_seconds() - start))
            found[name][method] = judged
            said = f"{method}: {', '.join(_shown([entry]) for entry in judged)}"
            tiles.append((made, [said]))
            print(f"{name}: {said}", file=sys.stderr)
        if request.out is not None:
            write_sheet(request.out / f"{name}.png", tiles)
    rows = []
    for method in [*here, *({REAL} & {method for own in found.values() for method in own})]:
        judged = [entry for own in found.values() for entry in own.get(method, [])]
        figures = [_figure(_mean(judged, "ps"), 1), _figure(_mean(judged, "swd"), 1000)]
        seconds = first = ""
        if method != REAL:
            seconds = f"{np.mean([entry.seconds for entry in judged]):.2f} s"
            first = f"{sum(_is_first(method, own) for own in found.values())} of {len(found)}"
        rows.append([LABELS.get(method, method), *figures, seconds, first])
    columns = (
        "program", "Portilla–Simoncelli error", "sliced Wasserstein, 10⁻³", "processor time", "first by rank",
    )  # fmt: skip
    note = "Lower is better. Rank: the sum of the ranks by the two measures; ties count for both."
    return Table(columns, rows, {"peers": versions("G'MIC", "resynthesizer"), "note": note})


def statistics_error(image: PixelArray, exemplar: PixelArray) -> float | None:
    """Return how far the texture statistics of Portilla and Simoncelli are from the exemplar's, relatively.

    ``‖S(image) − S(exemplar)‖ / ‖S(exemplar)‖``, S being all statistics of the steerable pyramid (4 scales, 4
    orientations, neighbourhood 7: 710 numbers for 128² and larger) of the whole picture in grey, sRGB-coded
    from 0 to 1, as the package plenoptic computes them. None where that is not installed.

    References
    ----------
    Portilla, Simoncelli: A parametric texture model based on joint statistics of complex wavelet
    coefficients, IJCV 40 (2000).
    """
    try:
        wanted, found = (_statistics(picture) for picture in (exemplar, image))
    except ImportError:
        return None
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def _statistics(picture: PixelArray) -> Any:
    import plenoptic
    import torch

    values = coded(picture).astype(np.float64)
    grey = values[:, :, 0] if values.shape[2] < 3 else values[:, :, :3] @ GREY
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of sizes that are no power of two, and of its own defaults
        model = plenoptic.models.PortillaSimoncelli(grey.shape).double()
        return model(torch.from_numpy(grey)[None, None])[0, 0].numpy()


def _judged(image: PixelArray, exemplar: PixelArray, seconds: float = 0.0) -> Judgement:
    swd = float(np.mean(sliced_wasserstein([image], exemplar)))
    return Judgement(statistics_error(image, exemplar), swd, seconds)


def _is_first(method: str, own: dict[str, list[Judgement]]) -> bool:
    sums = dict.fromkeys(own.keys() - {REAL}, 0.0)
    for field in JUDGED:
        known = {name: mean for name in sums if (mean := _mean(own[name], field)) is not None}
        for name, mean in known.items():
            better = sum(other < mean for other in known.values())
            equal = sum(other == mean for other in known.values())
            sums[name] += better + (equal + 1) / 2
    return sums[method] == min(sums.values())


def _mean(judged: list[Judgement], field: str) -> float | None:
    values = [value for entry in judged if (value := getattr(entry, field)) is not None]
    return float(np.mean(values)) if values else None


def _shown(judged: list[Judgement]) -> str:
    return f"PS {_figure(_mean(judged, 'ps'), 1)}, SWD {_figure(_mean(judged, 'swd'), 1000)}e-3"


def _figure(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.3f}"
