"""From an exemplar and a surface to a quilt in one call; and the checks and samples that come first."""

import secrets
from dataclasses import replace
from numbers import Integral
from typing import Any

from upholster.charts.directions import is_direction_image
from upholster.charts.surface_to_cover import CoveredLike, as_covered
from upholster.errors import InputError
from upholster.geometry import MeshSurface
from upholster.image import Material, check_exemplar
from upholster.image.source import Sample, Source, as_exemplar, used_pixels
from upholster.methods.guided import read_guidance
from upholster.methods.paper.coefficients import keep_coefficients
from upholster.methods.prepared import execute
from upholster.methods.set_up import prepare
from upholster.options import SampleOptions, SynthesisOptions, chosen
from upholster.parallel import check_running
from upholster.quilt.model import Quilt
from upholster.stages import keeping, stage
from upholster.types import PixelArray, Progress

__all__ = ["kept_sample", "matched_image", "needs_patches", "settled_seed", "synthesize"]


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
        The surface to cover; or its text form, ``"torus:R=2,r=0.7"``, or the path of its file. Or a mesh,
        which is laid out flat first; or one that is already laid out, see `upholster.charts.unwrap`.
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
    if isinstance(exemplar, Sample) and exemplar.size is not None:
        wanted = replace(wanted, sample_size=exemplar.size, element_size=None)
    check_running(threads, progress)
    seed, covered = settled_seed(seed), as_covered(surface, patches=needs_patches(wanted))
    surface, metres = covered.surface, None
    if isinstance(surface, MeshSurface):
        metres = surface.mesh.metres
    reading = exemplar.options if isinstance(exemplar, Sample) else SampleOptions()
    source, guidance = read_guidance(wanted, as_exemplar(exemplar), reading, metres)
    source = kept_sample(source, wanted)
    checked, used = matched_image(source, wanted), used_pixels(source)
    with keeping():
        prepared = prepare(checked, surface, wanted, model=covered.model, used=used, guidance=guidance)
        return execute(prepared, checked, surface, seed=seed, threads=threads, progress=progress)


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


def needs_patches(options: SynthesisOptions) -> bool:
    """Return whether the options require patches, and cannot be used on a mesh."""
    along = options.direction
    on_patches = callable(along) or (isinstance(along, str) and along.strip() in ("u", "v"))
    on_patches = on_patches or is_direction_image(along)
    return options.method != "quilt" or on_patches or isinstance(options.texels, tuple)


def kept_sample(exemplar: PixelArray | Material, options: SynthesisOptions) -> PixelArray | Material:
    """Return a sample as it is matched and painted: without small coefficients if the options say so.

    Each map of a material is treated separately.

    Raises
    ------
    InputError
        If `exemplar` is an array but not a valid exemplar.
    """
    if options.threshold is None and options.coefficients is None:
        return exemplar

    return _kept(exemplar, options.levels, options.threshold, options.coefficients)


@stage
def _kept(
    exemplar: PixelArray | Material, levels: int, threshold: float | None, coefficients: float | None
) -> PixelArray | Material:
    how: dict[str, Any] = {"levels": levels, "threshold": threshold, "coefficients": coefficients}
    if isinstance(exemplar, Material):
        kept = {role: keep_coefficients(image, **how) for role, image in exemplar.maps.items()}
        return Material(kept, used=exemplar.used)
    return keep_coefficients(check_exemplar(exemplar), **how)


def matched_image(exemplar: PixelArray | Material, options: SynthesisOptions) -> PixelArray:
    """Return the image to match: for "quilt" all maps of a material that count, otherwise the base colour.

    Returns
    -------
    ndarray
        (H, W, C), with as many channels as needed.

    Raises
    ------
    InputError
        If `exemplar` is an array but not a valid exemplar.
    """
    if isinstance(exemplar, Material):
        turned = options.mirror or options.rotate
        return _matched_maps(exemplar, turned) if options.method == "quilt" else _color(exemplar)
    return check_exemplar(exemplar)


@stage
def _matched_maps(material: Material, turned: bool) -> PixelArray:
    return material.matched(turned=turned)


@stage
def _color(material: Material) -> PixelArray:
    return material.color()
