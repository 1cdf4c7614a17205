"""Method "pixel", the paper's baseline, beside method "paper" on F1, by either way of search."""

from typing import Any

import upholster
from benchmarks.measure import EXEMPLAR, Results, median_processor_seconds

__all__ = ["pixel"]

CLAIM = "the paper: about 200 times, 15 to 20 minutes against 5 seconds"


def pixel(results: Results) -> None:
    """Time F1 (128² RGB, the paper's cyclide, 16 charts of 512²) by both methods, in processor seconds.

    Full search takes minutes. So it is timed on charts of 128², a sixteenth of the texels, and counted 16
    times: its time grows with their number.
    """
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    surface = upholster.ring_cyclide(6, 2, 3)

    def cover(**options: Any) -> None:
        upholster.paint(upholster.synthesize(exemplar, surface, seed=7, **options), exemplar)

    paper = median_processor_seconds(lambda: cover(method="paper"))
    coherent = median_processor_seconds(lambda: cover(method="pixel"), runs=1)
    full = 16 * median_processor_seconds(lambda: cover(method="pixel", search="full", chart=128), runs=1)
    for name, seconds in (("coherent search", coherent), ("full search, from a sixteenth", full)):
        remark = f"{seconds / paper:.0f} times as long as method paper; {CLAIM}"
        results.add(f"method pixel on the same charts, {name}", seconds, "s", remark=remark)
