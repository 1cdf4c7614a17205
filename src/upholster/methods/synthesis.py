"""From an exemplar and a surface to a quilt: the one place that settles layout, scale, direction, method."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upholster.charts.directions import Vectors, default_direction, direction_fields, parse_direction
from upholster.charts.layout import TextureScale, density_layout, texture_scale, uniform_layout
from upholster.errors import InputError, nearest
from upholster.geometry import Surface
from upholster.image import Material, check_exemplar
from upholster.methods.paper.method import PaperOptions, synthesize_paper
from upholster.methods.quilt.method import QuiltOptions, synthesize_quilt
from upholster.methods.quilt.structure import block_size
from upholster.quilt.chart import MAX_CHART, Chart
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.types import PixelArray, Progress

__all__ = ["METHODS", "Prepared", "execute", "matched_image", "prepare", "synthesize"]

METHODS = ("quilt", "paper")

_BLOCKS = 8
"""Blocks across a surface, at least, where their size is not asked for: fewer can not follow its curves."""

_ONLY: Mapping[str, tuple[str, ...]] = {
    "quilt": ("texels", "density", "sample_size", "direction", "evenness", "variety", "tileable"),
    "paper": ("chart", "levels", "seams"),
}


@dataclass(frozen=True, eq=False)
class Prepared:
    """What a synthesis will do, settled and checked before it begins.

    Attributes
    ----------
    method
        "quilt" or "paper".
    charts, fields
        The layout; fields are empty where the method has no use for them.
    scale
        Sizes of texels and sample on the surface; None where they were not asked for (method "paper", flat
        textures).
    direction
        In words; empty where there is none.
    options
        Parameters of the method.
    wrap
        Whether the one chart tiles.
    """

    method: str
    charts: tuple[Chart, ...]
    fields: tuple[WarpField, ...]
    scale: TextureScale | None
    direction: str
    options: QuiltOptions | PaperOptions
    wrap: bool = False


def matched_image(exemplar: PixelArray | Material, method: str = "quilt") -> PixelArray:
    """Return what a method looks at: of a material all maps that count; the base colour alone for "paper".

    Returns
    -------
    ndarray
        (H, W, C), C as many as that takes.

    Raises
    ------
    InputError
        If `exemplar` is an array that is no exemplar.
    """
    if isinstance(exemplar, Material):
        return exemplar.color() if method == "paper" else exemplar.matched()
    return check_exemplar(exemplar)


def prepare(
    exemplar: PixelArray,
    surface: Surface,
    *,
    method: str = "quilt",
    texels: int | tuple[int, int] | None = None,
    density: float | None = None,
    sample_size: float | None = None,
    direction: str | Vectors | None = None,
    tileable: bool | None = None,
    block: int | None = None,
    overlap: int | None = None,
    evenness: float | None = None,
    variety: float | None = None,
    chart: int | None = None,
    levels: int | None = None,
    seams: bool | None = None,
) -> Prepared:
    """Settle what `synthesize` will do; parameters as there.

    Raises
    ------
    InputError
        If something is out of range, does not fit together, or belongs to another method.
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}; {nearest(method, METHODS)}")
    given: dict[str, Any] = {
        "texels": texels,
        "density": density,
        "sample_size": sample_size,
        "direction": direction,
        "tileable": tileable,
        "evenness": evenness,
        "variety": variety,
        "chart": chart,
        "levels": levels,
        "seams": seams,
    }
    for owner, names in _ONLY.items():
        for name in names:
            if owner != method and given[name] is not None:
                raise InputError(
                    f"{name} belongs to method {owner!r}; allowed with {method!r}: {_listed(method)}"
                )
    if method == "paper":
        asked: dict[str, Any] = {"block": block, "overlap": overlap, "levels": levels, "seams": seams}
        options = PaperOptions(**{name: value for name, value in asked.items() if value is not None})
        return Prepared(
            method, uniform_layout(surface, chart=512 if chart is None else chart), (), None, "", options
        )
    most = min(512, 3 * min(exemplar.shape[:2]) // 4)  # beyond that there is nothing to choose from
    if block is not None and not 8 <= block <= most:
        raise InputError(f"block is {block}; allowed: 8 to {most} in an exemplar of {_size(exemplar)}")
    asked = {"overlap": overlap, "evenness": evenness, "variety": variety}
    options_ = QuiltOptions(
        block=block_size(exemplar) if block is None else block,
        **{name: value for name, value in asked.items() if value is not None},
    )
    if isinstance(texels, tuple):
        return _flat_plan(surface, texels, given, options_, bool(tileable))
    if tileable:
        raise InputError("tileable needs texels as width x height, on a surface of one patch")
    scale = texture_scale(
        surface,
        exemplar.shape[1],
        sample_size=sample_size,
        density=density,
        texels=texels,
        block=options_.block,
    )
    if sample_size is None:
        _check_room(scale, options_.block, density)
    if block is None:
        across = np.sqrt(scale.texels) / scale.density * scale.scale  # the surface, in exemplar pixels
        options_ = replace(options_, block=min(options_.block, max(16, 4 * int(across / _BLOCKS / 4))))
    wanted = default_direction(surface) if direction is None else parse_direction(direction)
    charts = density_layout(surface, density=scale.density)
    fields = direction_fields(surface, charts, wanted, scale.scale)
    return Prepared(method, charts, fields, scale, wanted.text, options_)


def _flat_plan(
    surface: Surface, texels: tuple[int, int], given: Mapping[str, Any], options: QuiltOptions, wrap: bool
) -> Prepared:
    width, height = texels
    if len(surface.patches) != 1:
        raise InputError(
            f"texels is {width}x{height} on {len(surface.patches)} patches; allowed there: a number"
        )
    for name in ("density", "sample_size", "direction"):
        if given[name] is not None:
            raise InputError(f"{name} is given with texels {width}x{height}; allowed: one of them")
    if not (8 <= width <= MAX_CHART and 8 <= height <= MAX_CHART):
        raise InputError(f"texels is {width}x{height}; allowed: 8 to {MAX_CHART} each way")
    return Prepared("quilt", (Chart(0, height, width),), (), None, "", options, wrap)


def execute(
    prepared: Prepared,
    exemplar: PixelArray,
    surface: Surface,
    *,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Synthesise as planned; the exemplar may have any number of channels here.

    Raises
    ------
    InputError
        If the seed or the number of threads is out of range, or the exemplar too small.
    """
    if isinstance(prepared.options, PaperOptions):
        return synthesize_paper(
            exemplar,
            surface,
            prepared.charts,
            options=prepared.options,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    return synthesize_quilt(
        exemplar,
        surface,
        prepared.charts,
        prepared.fields,
        options=prepared.options,
        wrap=prepared.wrap,
        seed=seed,
        threads=threads,
        progress=progress,
    )


def synthesize(
    exemplar: PixelArray | Material,
    surface: Surface,
    *,
    method: str = "quilt",
    texels: int | tuple[int, int] | None = None,
    density: float | None = None,
    sample_size: float | None = None,
    direction: str | Vectors | None = None,
    tileable: bool | None = None,
    block: int | None = None,
    overlap: int | None = None,
    evenness: float | None = None,
    variety: float | None = None,
    chart: int | None = None,
    levels: int | None = None,
    seams: bool | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Quilt:
    """Synthesise texture over a surface.

    Parameters
    ----------
    exemplar
        (H, W) or (H, W, C) with 1 to 4 channels, 32×32 to 4096×4096; uint8, uint16 or float. Or a
        material: its maps are matched together, by method "paper" its base colour alone.
    surface
        The surface to cover.
    method
        "quilt": one texture at true scale over the whole surface; "paper": the paper's, patch by patch
        (`upholster.methods.paper.method`).
    texels
        How many in all, 64 to 2^31; by default four million, or what `density` or `sample_size` ask for. On
        one patch also (width, height): a flat texture, one texel an exemplar pixel.
    density
        Texels per model unit, instead.
    sample_size
        Width of the exemplar in model units; by default an exemplar pixel is as large as a texel.
    direction
        Which way the exemplar's rows run: see `upholster.charts.directions.parse_direction`. By default
        along the patches, or round the z axis where these do not agree.
    tileable
        Whether a flat texture wraps both ways.
    block, overlap
        Side of a block and width of the overlap, in exemplar pixels; by default from the exemplar's own
        structure. Method "paper": 32 and 8, in texels.
    evenness, variety
        See `upholster.methods.quilt.method.QuiltOptions`.
    chart, levels, seams
        Method "paper": side of each patch's chart in texels (512), and see `PaperOptions`.
    seed
        0 to 2^63 − 1. The same seed gives the same quilt, whatever the number of threads and on any machine.
    threads
        1 to 256; by default one per core.
    progress
        Called as ``progress(stage, done, total)``, with stages "blocks" and, for method "paper", "seams".

    Returns
    -------
    Quilt
        Charts and placements; `upholster.paint` makes texels of it.

    Raises
    ------
    InputError
        If something is out of range or does not fit together, before any work is done.
    """
    checked = matched_image(exemplar, method)
    settled = prepare(
        checked,
        surface,
        method=method,
        texels=texels,
        density=density,
        sample_size=sample_size,
        direction=direction,
        tileable=tileable,
        block=block,
        overlap=overlap,
        evenness=evenness,
        variety=variety,
        chart=chart,
        levels=levels,
        seams=seams,
    )
    return execute(settled, checked, surface, seed=seed, threads=threads, progress=progress)


def _check_room(scale: TextureScale, block: int, density: float | None) -> None:
    # Of a sample size `texture_scale` has seen to it.
    share = (scale.scale / scale.density) ** 2 * scale.texels / block**2
    if share < 1:
        asked, least = (
            (f"texels is {scale.texels:,}", f"{block**2:,}")
            if density is None
            else (f"density is {density:g} texels per model unit", f"{density / share**0.5:.6g}")
        )
        raise InputError(
            f"{asked}, which puts less than one block of {block} pixels on the surface; "
            f"allowed: at least {least}"
        )


def _size(image: PixelArray) -> str:
    return f"{image.shape[1]}x{image.shape[0]} pixels"


def _listed(method: str) -> str:
    return ", ".join((*_ONLY[method], "block", "overlap"))
