"""Regular textures on surfaces: how much of a lattice is broken, over samples × surfaces × seeds.

Without a folder the samples are two generated ones (`benchmarks.lattice_samples`), bricks and weave. Besides
built-in surfaces there are ``flat``, a texture of 512², and ``net``, a bent vase. Rows run around the z axis,
and level on the bent vase.
"""

import sys
from collections import defaultdict
from typing import Any

import numpy as np

import upholster
from benchmarks.lattice_samples import lattice_sample
from benchmarks.measure import EXAMPLES, Request, one_pixel_a_texel, samples
from benchmarks.nets import bent_vase
from benchmarks.tables import Table
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import PixelArray
from upholster.covering.measure import BrokenElements, broken_elements, mapping
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.built_in.plane import plane
from upholster.image.elements.courses import find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import Lattice, find_lattice
from upholster.synthesis.execution import execute
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.setup import prepare

__all__ = ["measured"]

FLAT, NET = "flat", "net"
SURFACES = ("torus", "cyclide", "vase", "sphere", NET, FLAT)
GENERATED, OWN = ("running_bond", "herringbone"), ("bricks", "weave")


def measured(request: Request) -> Table:
    """Return means over the seeds by sample and surface, and of faults the longest."""
    if request.files:
        chosen = {name: exemplar for name, (exemplar, _) in samples(request).items()}
    else:
        chosen = {name: lattice_sample(name, side=256).image for name in GENERATED}
        chosen |= {name: upholster.read_exemplar(EXAMPLES / f"{name}.png", resize=128) for name in OWN}
    rows = []
    faults, sizes = defaultdict[str, list[float]](list), defaultdict[str, list[float]](list)
    for name, exemplar in chosen.items():
        lattice = find_lattice(exemplar)
        if lattice is None:
            print(f"{name}: no lattice", file=sys.stderr)
            continue
        cells = []
        for spec in SURFACES:
            found = [_covered(exemplar, lattice, spec, seed, request) for seed in range(1, request.seeds + 1)]
            faults[spec] += [max(broken.faults) for broken, _ in found]
            sizes[spec] += [within for _, within in found]
            shares = np.mean([broken.share for broken, _ in found], axis=0)
            cells.append("; ".join(f"{share:.1%}" for share in shares))
        rows.append([name.replace("_", " "), *cells])
        print(*rows[-1], file=sys.stderr, flush=True)
    rows.append(["longest fault, in periods", *(f"{max(faults[spec]):.1f}" for spec in SURFACES)])
    rows.append(
        ["area where the size is within 5 %, least", *(f"{min(sizes[spec]):.1%}" for spec in SURFACES)]
    )
    note = (
        "Broken elements by the lattice's first and second wave; of running bond and bricks between courses "
        "and along them."
    )
    return Table(("sample", *SURFACES), rows, {"note": note})


def _covered(
    exemplar: PixelArray, lattice: Lattice, spec: str, seed: int, request: Request
) -> tuple[BrokenElements, float]:
    surface = plane() if spec == FLAT else bent_vase() if spec == NET else surface_from_spec(spec)
    options: dict[str, Any] = {"texels": (512, 512)}
    if spec != FLAT:
        # Around an axis that the bent vase's neck is not on, rows would cross its rim at an angle.
        rows = "level" if spec == NET else "around:z"
        options = one_pixel_a_texel(surface, exemplar, request.texels or 2**20) | {"direction": rows}
    prepared = prepare(Exemplar(exemplar), surface, SynthesisOptions(**options))
    quilt = execute(prepared, Exemplar(exemplar), surface, seed=seed)
    scale = None if prepared.scale is None else prepared.scale.scale
    within = 1.0 if spec == FLAT else mapping(surface, quilt, scale=scale).within
    courses = find_courses(lattice, find_joints(exemplar))
    return broken_elements(quilt, lattice, surface, courses=courses), within
