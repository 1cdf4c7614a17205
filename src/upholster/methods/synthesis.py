"""From an exemplar and a surface to a quilt in one call."""

import secrets
from numbers import Integral
from typing import Any

from upholster.charts.surface_to_cover import CoveredLike
from upholster.errors import InputError
from upholster.image import Material
from upholster.image.source import Sample, Source, as_exemplar, used_pixels
from upholster.methods.prepared import execute
from upholster.methods.set_up import prepare
from upholster.methods.settling import covered_by_method, matched_image, settled
from upholster.options import SynthesisOptions, chosen
from upholster.parallel import check_running
from upholster.quilt.model import Quilt
from upholster.stages import keeping
from upholster.types import PixelArray, Progress

__all__ = ["settled_seed", "synthesize"]


def synthesize(
    exemplar: PixelArray | Material | Source | Sample,
    surface: CoveredLike,
    *,
    options: SynthesisOptions | None = None,
    seed: int | None = 0,
    threads: int | None = None,
    progress: Progress | None = None,
    **choices: Any,
) -> Quilt:
    """Synthesise texture over a surface.

    Parameters
    ----------
    exemplar
        (H, W) or (H, W, C) with 1 to 4 channels, 32×32 to 4096×4096; uint8, uint16 or float. Or a
        material: its maps are matched together, or by methods "paper" and "pixel" its base colour alone. Or
        the path of an image, or of a material's folder; or a `Sample`, which may name a mask.
    surface
        The surface to cover; or its text form, ``"torus:R=2,r=0.7"``, or the path of its file, or of a
        model's. With method "paper" the text ``"sphere"`` stands for octants. Or a mesh, which is laid out
        flat first; or one that is already laid out, see `upholster.charts.unwrap`.
    options
        Method, scale, direction and all other choices; see `upholster.SynthesisOptions`.
    seed
        0 to 2^63 − 1. The same seed gives the same quilt, whatever the number of threads and on any machine.
        None draws a random seed, which `Quilt.seed` records.
    threads
        1 to 256; by default one per core.
    progress
        Called as ``progress(stage, done, total)``, with stages "blocks" and, for method "paper", "seams"; for
        method "pixel" "texels".
    choices
        Single options, by their names in `upholster.SynthesisOptions`. They override `options`, and None is
        as if not given. The most useful ones: `method`, "quilt" (one texture at true scale
        over the whole surface), "paper" (the paper's, patch by patch) or "pixel" (texel by texel); `texels`,
        a number, or (width, height) of a flat texture; `sample_size`, the exemplar's width in model units;
        `direction`, in words, as degrees, as a vector (x, y, z) or as a function, see
        `upholster.charts.directions.parse_direction`.

    Returns
    -------
    Quilt
        Charts and placements; `upholster.paint` turns it into texels. With `threshold` or `coefficients` it
        is matched against the result of `upholster.methods.kept_sample`, which is then the sample to paint.

    Raises
    ------
    InputError
        If something is unknown, out of range or does not fit together, before any work is done.
    """
    wanted = chosen(SynthesisOptions, options, **choices)
    check_running(threads, progress)
    seed, covered = settled_seed(seed), covered_by_method(surface, wanted)
    source = as_exemplar(exemplar)
    sample = exemplar if isinstance(exemplar, Sample) else Sample(source)
    found = settled(sample, source, covered, wanted)
    checked = matched_image(found.source, found.options)
    with keeping():
        prepared = prepare(
            checked,
            covered.surface,
            found.options,
            model=covered.model,
            used=used_pixels(found.source),
            guidance=found.guidance,
        )
        return execute(prepared, checked, covered.surface, seed=seed, threads=threads, progress=progress)


def settled_seed(seed: int | None) -> int:
    """Return a seed as a number; for None a new one, drawn from the system.

    Raises
    ------
    InputError
        If it is neither None nor 0 to 2^63 − 1.
    """
    if seed is None:
        return secrets.randbits(32)
    if not (isinstance(seed, Integral) and 0 <= seed < 2**63):
        raise InputError(f"seed is {seed!r}; allowed: 0 to 2^63 - 1")
    return int(seed)
