"""From an exemplar and a surface to a quilt in one call."""

from typing import Any

from upholster.base.options.choices import chosen, seed_number
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import PixelArray, Progress
from upholster.charts.surface_to_cover import CoveredLike
from upholster.covering.request import Request
from upholster.image.files.material import Material
from upholster.image.files.source import Sample, Source, as_exemplar
from upholster.quilt.model import Quilt
from upholster.runtime.parallel import running
from upholster.runtime.stages import keeping

__all__ = ["synthesize"]


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
        Called as ``progress(stage, done, total)``, with stages "unwrap" while a mesh is laid out, "blocks"
        and, for method "paper", "seams"; for method "pixel" "texels".
    choices
        Single options, by their names in `upholster.SynthesisOptions`. They override `options`, and None is
        as if not given. The most useful ones: `method`, "quilt" (one texture at true scale
        over the whole surface), "paper" (the paper's, patch by patch) or "pixel" (texel by texel); `texels`,
        a number, or (width, height) of a flat texture; `sample_size`, the exemplar's width in model units;
        `direction`, in words, as degrees, as a vector (x, y, z) or as a function, see
        `upholster.charts.directions.direction.parse_direction`.

    Returns
    -------
    Quilt
        Charts and placements; `upholster.paint` turns it into texels. With `threshold` or `coefficients` it
        is matched against the result of `upholster.synthesis.surface_request.kept_sample`, which is then the
        sample to paint.

    Raises
    ------
    InputError
        If something is unknown, out of range or does not fit together, before any work is done.
    """
    asked = chosen(SynthesisOptions, options, **choices)
    with running(threads, progress), keeping():
        sample = exemplar if isinstance(exemplar, Sample) else Sample(as_exemplar(exemplar))
        return Request(sample, surface, synthesis=asked, seed=seed_number(seed)).quilt()
