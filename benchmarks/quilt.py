"""Method "quilt": flat textures, the paper's cyclide at 4.2 Mtexels, and how time grows with texels."""

import upholster
from benchmarks.flagship import gmic_seconds
from benchmarks.measure import EXEMPLAR, Results, median_seconds, one_pixel_a_texel
from upholster.geometry import Surface
from upholster.methods import execute, prepare
from upholster.options import SynthesisOptions
from upholster.types import PixelArray

__all__ = ["quilt"]


EFFORTS = (0, 1)

FLAT_AIMS = {(128, 0): "at most 35", (128, 1): "at most 80", (1024, 1): "at most 250"}
"""In milliseconds, by the sample's side and the effort."""

CYCLIDE_AIMS = {0: "at most 0.7", 1: "at most 1.2"}
"""In seconds for 4 Mtexels, by the effort."""


def quilt(results: Results) -> None:
    """Time synthesis and painting together by effort, G'MIC in the same run."""
    default = _flat(results, 128, runs=15)
    _flat(results, 1024, runs=7)
    peer = gmic_seconds()
    if peer is not None:
        results.add("quilt: flat, G'MIC's time over ours", peer / default, "times")
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    ring = upholster.ring_cyclide(6, 2, 3)
    _ = ring.shared
    for effort in EFFORTS:
        _cyclide(results, exemplar, ring, effort)


def _flat(results: Results, side: int, *, runs: int) -> float:
    # Flat textures from a sample of that side; returns the seconds of the last effort, the default.
    exemplar, plane, seconds = upholster.read_exemplar(EXEMPLAR, resize=side), upholster.plane(), 0.0
    for effort in EFFORTS:

        def flat(effort: int = effort) -> None:
            made = upholster.synthesize(exemplar, plane, texels=(512, 512), effort=effort, seed=7)
            upholster.paint(made, exemplar)

        seconds = median_seconds(flat, runs=runs)
        aim = FLAT_AIMS.get((side, effort), "")
        results.add(f"quilt: flat, {side}² to 512², effort {effort}", 1000 * seconds, "ms", aim=aim)
    return seconds


def _cyclide(results: Results, exemplar: PixelArray, ring: Surface, effort: int) -> None:
    first = 0.0
    for texels in (2**20, 2**22, 2**24, 2**26):
        options = SynthesisOptions(**one_pixel_a_texel(ring, exemplar, texels), effort=effort)
        prepared = prepare(exemplar, ring, options)
        placements = len(execute(prepared, exemplar, ring, seed=7).placements)

        def whole(options: SynthesisOptions = options) -> None:
            made = upholster.synthesize(exemplar, ring, options=options, seed=7)
            upholster.paint(made, exemplar)

        seconds = median_seconds(whole, runs=5 if texels <= 2**22 else 2)
        first = first or seconds / texels
        results.add(
            f"quilt: cyclide, {texels / 2**20:.0f} Mtexels, effort {effort}",
            seconds,
            "s",
            aim=CYCLIDE_AIMS[effort] if texels == 2**22 else "",
            remark=f"{placements} placements, {1e9 * seconds / texels:.0f} ns a texel, "
            f"{seconds / texels / first:.2f} of 1 Mtexel's",
        )
