"""Flat results against their exemplars: method "paper" and G'MIC, 128² → 512², by the measures of a picture.

Run alone with ``python -m benchmarks.fidelity [FOLDER]``: by default on the project's examples, else on all
images of a folder.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import upholster
from benchmarks.measure import EXEMPLAR, Results, median_seconds
from upholster.image import IMAGE_SUFFIXES, read_image, write_image
from upholster.measure import Measures, measure_cover, measure_image
from upholster.types import PixelArray

__all__ = ["fidelity"]

SEEDS = (1, 2, 3)


def fidelity(results: Results, folder: Path = EXEMPLAR.parent) -> None:
    """Measure every exemplar of a folder, by three seeds each; and time the measuring itself, on F1."""
    _time(results)
    names = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)
    totals: dict[str, list[float]] = {}
    for name in names:
        exemplar = upholster.read_exemplar(name, resize=(128, 128))
        methods = {"paper": [_paper(exemplar, seed) for seed in SEEDS]}
        if shutil.which("gmic"):
            # Its random numbers take no seed: three runs.
            methods["G'MIC"] = [_gmic(exemplar) for _ in SEEDS]
        for method, images in methods.items():
            found = [measure_image(image, exemplar) for image in images]
            distance = _mean(measures.wasserstein_mean for measures in found)
            totals.setdefault(method, []).append(distance)
            results.add(
                f"fidelity, {name.stem}, {method}: sliced Wasserstein distance",
                1000 * distance,
                "1e-3",
                remark=_structure(found),
            )
    for method, distances in totals.items():
        results.add(
            f"fidelity, {len(distances)} exemplars, {method}: mean sliced Wasserstein distance",
            1000 * _mean(distances),
            "1e-3",
        )


def _time(results: Results) -> None:
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)
    quilt = upholster.synthesize(exemplar, surface, seed=7)
    texels = upholster.paint(quilt, exemplar)
    seconds = median_seconds(lambda: measure_cover(surface, quilt, exemplar, texels=texels), runs=3)
    results.add("all measures of F1", seconds, "s", aim="at most 5")


def _paper(exemplar: PixelArray, seed: int) -> PixelArray:
    quilt = upholster.synthesize(exemplar, upholster.plane(), chart=512, seed=seed)
    return upholster.paint(quilt, exemplar).arrays[0]


def _gmic(exemplar: PixelArray) -> PixelArray:
    with tempfile.TemporaryDirectory() as folder:
        sample, out = f"{folder}/sample.png", f"{folder}/out.png"
        write_image(sample, exemplar)
        command = ["gmic", "-v", "-", sample, "syntexturize_matchpatch", "512,512", "-o", out]
        subprocess.run(command, check=True, capture_output=True)
        found = read_image(out)
    # It may write grey as RGB or the reverse.
    return found if found.shape[2] == exemplar.shape[2] else found[:, :, : exemplar.shape[2]]


def _structure(found: list[Measures]) -> str:
    losses = [measures.structure.loss for measures in found if measures.structure.loss is not None]
    return f"structure lost {_mean(losses):.3f}" if losses else "no structure to lose"


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


if __name__ == "__main__":
    table = Results()
    fidelity(table, *(Path(argument) for argument in sys.argv[1:2]))
    table.show()
