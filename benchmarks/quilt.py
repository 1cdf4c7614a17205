"""Method "quilt": flat textures, the paper's cyclide at 4.2 Mtexels, and how time grows with texels."""

import upholster
from benchmarks.flagship import gmic_seconds
from benchmarks.measure import EXEMPLAR, Results, median_seconds, one_pixel_a_texel
from upholster.methods import execute, prepare
from upholster.options import SynthesisOptions
from upholster.types import PixelArray

__all__ = ["quilt"]


def quilt(results: Results) -> None:
    """Time synthesis and painting together, G'MIC in the same run."""
    exemplar = upholster.read_exemplar(EXEMPLAR, resize=128)
    plane = upholster.plane()

    def flat(image: PixelArray = exemplar) -> None:
        made = upholster.synthesize(image, plane, texels=(512, 512), seed=7)
        upholster.paint(made, image)

    small = median_seconds(flat, runs=15)
    results.add("quilt: flat, 128² to 512²", 1000 * small, "ms", aim="at most 80")
    large = upholster.read_exemplar(EXEMPLAR, resize=1024)
    results.add(
        "quilt: flat, 1024² to 512²",
        1000 * median_seconds(lambda: flat(large), runs=7),
        "ms",
        aim="at most 250",
    )
    peer = gmic_seconds()
    if peer is not None:
        results.add("quilt: flat, G'MIC's time over ours", peer / small, "times")
    ring = upholster.ring_cyclide(6, 2, 3)
    _ = ring.shared
    first = 0.0
    for texels in (2**20, 2**22, 2**24, 2**26):
        options = SynthesisOptions(**one_pixel_a_texel(ring, exemplar, texels))
        prepared = prepare(exemplar, ring, options)
        placements = len(execute(prepared, exemplar, ring, seed=7).placements)

        def whole(options: SynthesisOptions = options) -> None:
            made = upholster.synthesize(exemplar, ring, options=options, seed=7)
            upholster.paint(made, exemplar)

        seconds = median_seconds(whole, runs=5 if texels <= 2**22 else 2)
        first = first or seconds / texels
        results.add(
            f"quilt: cyclide, {texels / 2**20:.0f} Mtexels",
            seconds,
            "s",
            aim="at most 1.2" if texels == 2**22 else "",
            remark=f"{placements} placements, {1e9 * seconds / texels:.0f} ns a texel, "
            f"{seconds / texels / first:.2f} of 1 Mtexel's",
        )
