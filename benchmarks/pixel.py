"""Method "pixel", the paper's baseline, beside method "paper" on F1, by either way of search."""

import time
from typing import Any

import upholster
from benchmarks.measure import EXEMPLAR, Results, median_seconds

__all__ = ["pixel"]

CLAIM = "the paper: 15 to 20 minutes against about 5 s, about 200"


def pixel(results: Results) -> None:
    """Time F1 (128² RGB, the paper's cyclide, 16 charts of 512²) by "paper" and by "pixel", with painting.

    Full search takes minutes, so it is timed on the same surface with charts of 256², a quarter of the
    texels, and taken four times: its time goes with their number.
    """
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)

    def cover(**options: Any) -> None:
        upholster.paint(upholster.synthesize(exemplar, surface, seed=7, **options), exemplar)

    paper = median_seconds(lambda: cover(method="paper"))
    results.add("F1 by method paper", paper, "s", remark="the paper: about 5 s")
    coherent = median_seconds(lambda: cover(method="pixel"), runs=3)
    results.add("F1 by method pixel, coherent search", coherent, "s", remark="Mtexels/s: " + _rate(coherent))
    results.add("the same against method paper", coherent / paper, "times", remark=CLAIM)
    quarter = median_seconds(lambda: cover(method="pixel", chart=256), runs=3)
    cover(method="pixel", search="full", chart=16)
    start = time.perf_counter()
    cover(method="pixel", search="full", chart=256)
    part = time.perf_counter() - start
    results.add(
        "a quarter of F1's texels, full search", part, "s", remark=f"coherent search: {quarter:.3g} s"
    )
    results.add("F1 by method pixel, full search", 4 * part, "s", remark="extrapolated: four times a quarter")
    results.add("the same against method paper", 4 * part / paper, "times", remark=CLAIM)


def _rate(seconds: float) -> str:
    return f"{16 * 512 * 512 / seconds / 1e6:.2f}"
