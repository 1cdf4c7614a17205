"""The picture of a shattered grid and a whole one in docs/measures.md, and what measures say of both.

``python -m benchmarks.broken_picture OUT``: OUT is a .png or .jpg file.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import upholster
from benchmarks.fidelity_measures import statistics_error
from benchmarks.lattice_samples import Image, lattice_sample
from upholster.elements import Lattice, find_lattice
from upholster.geometry import plane
from upholster.image import resize_image, write_image
from upholster.measure import broken_elements, measure_image
from upholster.measure.broken import jumps_of
from upholster.measure.samples import Window
from upholster.measure.source_cuts import cuts_inside
from upholster.measure.trace import Trace
from upholster.options import SynthesisOptions
from upholster.quilt import Quilt

__all__ = ["main"]

SIDE = 512
SHOWN = 400
COLORS = ((255, 220, 0), (0, 255, 255))
"""Of cuts that break the first wave, and the second."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.broken_picture", description=__doc__)
    parser.add_argument("out", type=Path, metavar="OUT")
    asked = parser.parse_args(arguments)
    exemplar = lattice_sample("stack_bond", side=160, unit=16).image
    lattice = find_lattice(exemplar)
    assert lattice is not None
    pictures = []
    whole = SynthesisOptions(texels=(SIDE, SIDE))
    for name, options in (("shattered", replace(whole, phase=0.0, block=20)), ("whole", whole)):
        quilt = upholster.synthesize(exemplar, plane(), options=options, seed=3)
        image = upholster.paint(quilt, exemplar).arrays[0]
        found, broken = measure_image(image, exemplar), broken_elements(quilt, lattice)
        assert found.patches is not None
        print(
            f"{name}: sliced Wasserstein {1000 * found.wasserstein_mean:.2f}e-3, "
            f"Portilla-Simoncelli {statistics_error(image, exemplar)}, "
            f"structure lost {found.structure.loss:.3f}, "
            f"broken {', '.join(f'{share:.1%}' for share in broken.share)}, "
            f"longest fault {', '.join(f'{fault:.1f}' for fault in broken.faults)} periods, "
            f"patch distance {found.patches.to_sample:.3f} and {found.patches.to_result:.3f}"
        )
        pictures.append(_doubled(image))
        if name == "shattered":
            pictures.append(_marked(quilt, lattice, image))
    gap = np.full((2 * SHOWN, 16, 3), 255, np.uint8)
    row = np.concatenate([pictures[0], gap, pictures[1], gap, pictures[2]], axis=1)
    write_image(asked.out, resize_image(row, height=SHOWN, width=row.shape[1] // 2), quality=82)
    return 0


def _doubled(image: Image) -> Image:
    return np.repeat(np.repeat(image[:SHOWN, :SHOWN], 2, axis=0), 2, axis=1)


def _marked(quilt: Quilt, lattice: Lattice, image: Image) -> Image:
    # The same, darker, with the cuts that break the lattice.
    out = _doubled((0.55 * image).astype(np.uint8))
    for cuts in cuts_inside(Trace.of(quilt, Window(0, 0, 0, SHOWN, SHOWN))):
        jumps = jumps_of(cuts, lattice)
        for k, color in enumerate(COLORS):
            for (r0, c0), (r1, c1) in cuts.ends[np.abs(jumps[:, k]) > 0.25].tolist():
                out[max(0, 2 * r0 - 2) : 2 * r1 + 2, max(0, 2 * c0 - 2) : 2 * c1 + 2] = color
    return out


if __name__ == "__main__":
    sys.exit(main())
