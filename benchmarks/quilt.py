"""Method "quilt": flat textures, the paper's cyclide at 4.2 Mtexels, and how time grows with texels."""

import upholster
from benchmarks.flagship import gmic_seconds
from benchmarks.measure import EXEMPLAR, Results, median_seconds, one_pixel_a_texel
from upholster.geometry import Surface
from upholster.methods import execute, prepare
from upholster.options import SynthesisOptions
from upholster.types import PixelArray

__all__ = ["quilt"]


FLAT_AIMS = {128: "at most 80", 1024: "at most 250"}
"""In milliseconds, by the sample's side."""

CYCLIDE_AIM = "at most 1.2"
"""In seconds for 4 Mtexels."""


def quilt(results: Results) -> None:
    """Time synthesis and painting together, G'MIC in the same run."""
    seconds = _flat(results, 128, runs=15)
    _flat(results, 1024, runs=7)
    peer = gmic_seconds()
    if peer is not None:
        results.add("quilt: flat, G'MIC's time over ours", peer / seconds, "times")
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    ring = upholster.ring_cyclide(6, 2, 3)
    _cyclide(results, exemplar, ring)


def _flat(results: Results, side: int, *, runs: int) -> float:
    # Flat textures from a sample of that side; returns the seconds that one takes.
    exemplar, plane = upholster.read_exemplar(EXEMPLAR, resize=side), upholster.plane()

    def flat() -> None:
        made = upholster.synthesize(exemplar, plane, texels=(512, 512), seed=7)
        upholster.paint(made, exemplar)

    seconds = median_seconds(flat, runs=runs)
    results.add(f"quilt: flat, {side}² to 512²", 1000 * seconds, "ms", aim=FLAT_AIMS[side])
    return seconds


def _cyclide(results: Results, exemplar: PixelArray, ring: Surface) -> None:
    first = 0.0
    for texels in (2**18, 2**20, 2**22, 2**24):
        options = SynthesisOptions(**one_pixel_a_texel(ring, exemplar, texels))
        prepared = prepare(exemplar, ring, options)
        placements = len(execute(prepared, exemplar, ring, seed=7).placements)

        def whole(options: SynthesisOptions = options) -> None:
            made = upholster.synthesize(exemplar, ring, options=options, seed=7)
            upholster.paint(made, exemplar)

        seconds = median_seconds(whole, runs=5 if texels <= 2**22 else 2)
        first = first or seconds / texels
        results.add(
            f"quilt: cyclide, {texels / 2**20:g} Mtexels",
            seconds,
            "s",
            aim=CYCLIDE_AIM if texels == 2**22 else "",
            remark=f"{placements} placements, {1e9 * seconds / texels:.0f} ns a texel, "
            f"{seconds / texels / first:.2f} of the smallest's",
        )
