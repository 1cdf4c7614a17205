"""What a request means on a surface: options that depend on its parts, the sample, and what steers it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.types import PixelArray
from upholster.charts.axis_directions import closed_rounds
from upholster.charts.directions.direction_image import is_direction_image
from upholster.charts.directions.strokes import stroke_texts
from upholster.charts.layout import texture_scale
from upholster.charts.maps.map_text import parse_map
from upholster.charts.part_directions import is_by_part, part_direction, triangles_by_direction
from upholster.charts.surface_to_cover import Covered
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.model_files.model_file import ModelFile
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.material import Material
from upholster.image.files.read import check_exemplar
from upholster.image.files.source import Sample, used_pixels
from upholster.runtime.stages import stage
from upholster.synthesis.exemplar import Exemplar, Guidance
from upholster.synthesis.guidance_reader import read_guidance
from upholster.synthesis.paper.coefficients import keep_coefficients
from upholster.synthesis.setup import sample_width
from upholster.synthesis.size_fit import fitted

__all__ = ["SurfaceRequest", "kept_sample", "matched_image", "needs_patches", "surface_request"]


@dataclass(frozen=True, eq=False, slots=True)
class SurfaceRequest:
    """A request for one sample, complete for its surface.

    Attributes
    ----------
    source
        The sample or material to paint, with the samples of zones.
    exemplar
        The same as blocks are compared by it.
    options
        The options, with the sample's own width, strokes from files, and directions of parts as a function.
    notes
        What the user should know, one line each.
    """

    source: PixelArray | Material
    exemplar: Exemplar
    options: SynthesisOptions
    notes: tuple[str, ...]


def surface_request(
    sample: Sample,
    source: PixelArray | Material,
    covered: Covered,
    asked: SynthesisOptions,
    held: tuple[str, ...] = (),
) -> SurfaceRequest:
    """Complete a request for its surface.

    Parameters
    ----------
    sample, source
        The sample, and what was read from it. Its width counts before that in `asked`.
    covered, asked
        The surface, and how it is to be covered.
    held
        Regions that stay as they are in another quilt, as `parse_map` reads them.

    Raises
    ------
    InputError
        If a file can not be read, or an option does not fit the surface or the sample.
    """
    if sample.size is not None:
        asked = replace(asked, sample_size=sample.size, element_size=None)
    if asked.stroke is not None:
        asked = replace(asked, stroke=stroke_texts(asked.stroke))
    asked, notes = _with_axes(asked, covered, source)
    metres = covered.surface.mesh.metres if isinstance(covered.surface, MeshSurface) else None
    source, guidance = read_guidance(asked, source, sample.options, metres)
    source = kept_sample(source, asked)
    exemplar = _exemplar(matched_image(source, asked), source, guidance, held)
    return SurfaceRequest(source, exemplar, asked, tuple(notes))


@stage
def _exemplar(
    pixels: PixelArray, source: PixelArray | Material, guidance: Guidance, held: tuple[str, ...]
) -> Exemplar:
    # A stage, because those that get it recognise it by its identity.
    guidance = replace(guidance, held=tuple(map(parse_map, held))) if held else guidance
    return Exemplar(pixels, used_pixels(source), guidance)


def _with_axes(
    asked: SynthesisOptions, covered: Covered, source: PixelArray | Material
) -> tuple[SynthesisOptions, list[str]]:
    """Return options with the direction on each part of a model, and the size that fits; and notes."""
    if not is_by_part(asked.direction):
        return asked, []
    if covered.model is None:
        file = "a CAD model's file" if isinstance(asked.direction, str) else "a model's file"
        raise InputError(f"direction is {on_a_line(asked.direction)}; allowed: with {file}")
    direction = part_direction(covered.model, cast(str | Mapping[str, str], asked.direction))
    notes = []
    if asked.fit:
        asked, note = _fitted(asked, covered, covered.model, matched_image(source, asked))
        notes = [note]
    return replace(asked, direction=direction, fit=False), notes


def _fitted(
    asked: SynthesisOptions, covered: Covered, model: ModelFile, seen: PixelArray
) -> tuple[SynthesisOptions, str]:
    """Return options with a sample size for which whole periods go round; and a note about the result."""
    lattice = find_lattice(seen)
    by_direction = triangles_by_direction(model, cast(str | Mapping[str, str], asked.direction))
    around, along = (
        closed_rounds(model, by_direction[kind]) if kind in by_direction else []
        for kind in ("around", "along")
    )
    count = len(around) + len(along)
    if lattice is None or not count:
        why = "the sample does not repeat surely enough" if lattice is None else "no cylinder closes round"
        return asked, f"nothing is fitted: {why}"
    width = sample_width(seen, asked, model.mesh.metres)
    scale = texture_scale(covered.surface, seen.shape[1], sample_size=width)
    factor, left = fitted(lattice, around, along, scale.scale)
    wide = factor * scale.sample_size
    note = (
        f"the sample is {wide:.4g} wide instead of {scale.sample_size:.4g} ({100 * (factor - 1):+.1f} %), so "
        f"that whole periods go round {count} cylinder{'s' * (count > 1)}; {left:.2f} of one "
        "is left over"
    )
    return replace(asked, sample_size=wide, element_size=None), note


def needs_patches(options: SynthesisOptions) -> bool:
    """Return whether the options require patches, and cannot be used on a mesh."""
    along = options.direction
    on_patches = callable(along) or (isinstance(along, str) and along.strip() in ("u", "v"))
    on_patches = on_patches or is_direction_image(along)
    return options.method != "quilt" or on_patches or isinstance(options.texels, tuple)


def kept_sample(source: PixelArray | Material, options: SynthesisOptions) -> PixelArray | Material:
    """Return a sample as it is matched and painted: without small coefficients if the options say so.

    Each map of a material is treated separately.

    Raises
    ------
    InputError
        If `source` is an array but not a valid exemplar.
    """
    if options.threshold is None and options.coefficients is None:
        return source

    return _kept(source, options.levels, options.threshold, options.coefficients)


@stage
def _kept(
    source: PixelArray | Material, levels: int, threshold: float | None, coefficients: float | None
) -> PixelArray | Material:
    how: dict[str, Any] = {"levels": levels, "threshold": threshold, "coefficients": coefficients}
    if isinstance(source, Material):
        kept = {role: keep_coefficients(image, **how) for role, image in source.maps.items()}
        return Material(kept, used=source.used)
    return keep_coefficients(check_exemplar(source), **how)


def matched_image(source: PixelArray | Material, options: SynthesisOptions) -> PixelArray:
    """Return the image to match: for "quilt" all maps of a material that count, otherwise the base colour.

    Returns
    -------
    ndarray
        (H, W, C), with as many channels as needed.

    Raises
    ------
    InputError
        If `source` is an array but not a valid exemplar.
    """
    if isinstance(source, Material):
        turned = options.mirror or options.rotate
        return _matched_maps(source, turned) if options.method == "quilt" else _color(source)
    return check_exemplar(source)


@stage
def _matched_maps(material: Material, turned: bool) -> PixelArray:
    return material.matched(turned=turned)


@stage
def _color(material: Material) -> PixelArray:
    return material.color()
