"""The layout: which charts cover which faces, and their sizes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.face_cuts import Halving
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import MAX_CHART, MAX_TEXELS, Chart
from upholster.runtime.stages import stage

__all__ = [
    "LONGEST",
    "TextureScale",
    "area_of",
    "default_width",
    "density_layout",
    "face_areas",
    "texture_scale",
    "uniform_layout",
]

LONGEST = 4096
"""Texels of a chart each way, at most: any device can hold a texture of that size."""

SHARE = 6
"""By default the model's diagonal is as long as this many samples are wide."""

MOST_TEXELS = 2**23
"""By default a texel is half as wide as a pixel of the sample, or as wide where that would make more than
this many; there are at most this many."""

MOST_FACES_TEXELS = 2**26
"""Texels that many small faces may raise this to, at most."""

PER_TEXEL = 64
"""Pixels of the sample per texel, or texels per pixel, at most, each way."""


def uniform_layout(surface: Surface, *, chart: int = 512) -> tuple[Chart, ...]:
    """Lay one square chart over every patch, all of the same size, as the paper does.

    Parameters
    ----------
    surface
        The surface to cover.
    chart
        Side of each chart in texels, 8 to 16384; at most 2^31 texels in all.

    Raises
    ------
    InputError
        For a size out of range or too many texels; the message says how much memory they would take.
    """
    if not 8 <= chart <= MAX_CHART:
        raise InputError(f"chart is {chart} texels; allowed: 8 to {MAX_CHART}")
    count = len(surface.patches) * chart * chart
    if count > MAX_TEXELS:
        raise InputError(
            f"chart {chart} on {len(surface.patches)} patches makes {count:,} texels, which would take "
            f"{3 * count / 2**30:.1f} GiB as 8-bit RGB; allowed: {MAX_TEXELS:,}"
        )
    charts = []
    for patch in range(len(surface.patches)):
        face, row, column = surface.place(patch)
        charts.append(Chart(face, chart, chart, float(row), row + 1.0, float(column), column + 1.0))
    return tuple(charts)


@stage
def density_layout(
    surface: Surface,
    *,
    texels: int | None = None,
    density: float | None = None,
    smallest: int = 32,
    thinnest: int = 16,
    largest: int = LONGEST,
) -> tuple[Chart, ...]:
    """Lay charts over a surface so that texels have about the same size everywhere.

    A chart's height and width are its typical extents along s and t (area-weighted geometric means of the
    derivatives' lengths, corrected for their angle) times the density. Charts may span several patches. Faces
    are cut where derivatives jump, and where the area element varies a lot: until the ratio of the 99th to
    the 1st percentile of texel area on each chart is 2, or charts would be too small. A chart may be its own
    neighbour.

    Parameters
    ----------
    surface
        The surface to cover.
    texels
        Total number, 64 to 2^31, met to within 1 %; the density follows from it.
    density
        Texels per model unit; give this or `texels`.
    smallest
        Least height and width of a chart in texels, 1 to 4096, where the faces' sizes and evenness allow it.
    thinnest
        Least height and width in texels where a complete face is smaller: 1 to `smallest`.
    largest
        Greatest height and width of a chart in texels.

    Returns
    -------
    tuple of Chart
        Sorted by face, then by first row and first column.

    Raises
    ------
    InputError
        If not exactly one of `texels` and `density` is given, one is outside its range, the surface has no
        area, it has so many faces that `thinnest` takes more than `texels`, or the result has more than 2^31
        texels.
    """
    if (texels is None) == (density is None):
        raise InputError("a layout needs exactly one of texels and density")
    if not 1 <= smallest <= 4096:
        raise InputError(f"smallest is {smallest} texels; allowed: 1 to 4096")
    if not 1 <= thinnest <= smallest:
        raise InputError(f"thinnest is {thinnest} texels; allowed: 1 to {smallest}")
    if texels is not None and not 64 <= texels <= MAX_TEXELS:
        raise InputError(f"texels is {texels:,}; allowed: 64 to {MAX_TEXELS:,}")
    smallest, thinnest = min(smallest, largest), min(thinnest, largest)
    halving = Halving(surface)
    area = _checked_area(halving.total_area, surface)
    if texels is not None:
        fewest = thinnest * thinnest * len(surface.faces)
        if fewest > texels:
            raise InputError(
                f"texels is {texels:,}; allowed: at least {fewest:,} on {len(surface.faces)} faces, "
                f"{thinnest} by {thinnest} each"
            )
        found = float(np.sqrt(texels / area))
    else:
        assert density is not None
        found = _positive("density", density, "texels per model unit")
        _check_total(found * found * area)
    halving.even_out(found, smallest, thinnest)
    while True:
        extents, whole = _extents(halving)
        if texels is not None:
            found = _density(extents, whole, texels, smallest, thinnest)
        sizes = _rounded(extents, whole, found, smallest, thinnest)
        if sizes.max() <= largest:
            break
        if not halving.cut_longest(largest / found):
            raise InputError(f"a chart would be {int(sizes.max()):,} texels long; allowed: {largest:,}")
    _check_total(float(sizes.prod(axis=1, dtype=np.float64).sum()))
    return tuple(
        Chart(piece.face, height, width, *halving.parameters(piece))
        for piece, (height, width) in zip(halving.pieces, sizes.tolist(), strict=True)
    )


@dataclass(frozen=True, slots=True)
class TextureScale:
    """The sizes of texels and of the sample on a surface.

    Attributes
    ----------
    density
        Texels per model unit.
    scale
        Exemplar pixels per model unit.
    sample_size
        Width of the exemplar in model units.
    texels
        Approximate number of texels that the surface takes at this density.
    """

    density: float
    scale: float
    sample_size: float
    texels: int


def texture_scale(
    surface: AnySurface,
    exemplar_width: int,
    *,
    sample_size: float | None = None,
    density: float | None = None,
    texels: int | None = None,
    block: int = 32,
    smallest: int = 48,
) -> TextureScale:
    """Choose the sizes of texels and sample on a surface from what the user asked for.

    Without a sample size, the sample's width is a sixth of the model's diagonal, whatever its number of
    pixels; on a surface so thin that half the square root of its area is less, it is that. Without texels or
    density, a texel is half as wide as a pixel of the sample, or as wide where that would make more than 2^23
    texels, and there are at most 2^23. A surface of many faces gets as many more as charts of `smallest`
    texels need, up to 2^26.

    Parameters
    ----------
    surface
        The surface to cover.
    exemplar_width
        Width of the exemplar in pixels.
    sample_size
        Width of the exemplar in model units.
    density, texels
        Texels per model unit, or their total number; at most one of the two.
    block
        Side of a block in texels: the surface must hold at least one block's worth of exemplar pixels.
    smallest
        As for `density_layout`.

    Raises
    ------
    InputError
        If a number is not finite and positive, `density` and `texels` are both given, the surface has no
        area, the surface would hold less than one block of the sample, a texel would hold more than 64 pixels
        of it or less than 1/64, or there would be more than 2^31 texels.
    """
    if density is not None and texels is not None:
        raise InputError("density and texels are both given; allowed: at most one of them")
    area = _checked_area(area_of(surface), surface)
    if sample_size is None:
        width = default_width(surface.size, area)
    else:
        width = _positive("sample size", sample_size, "model units")
    scale = exemplar_width / width
    if scale * scale * area < block * block:
        raise InputError(
            f"sample size is {width:g} model units, which puts less than one block of {block} "
            f"pixels on a model of {surface.size:.4g} (diagonal); "
            f"allowed: at most {exemplar_width * np.sqrt(area) / block:.6g}"
        )
    if density is not None:
        found = _positive("density", density, "texels per model unit")
    elif texels is not None:
        if not 64 <= texels <= MAX_TEXELS:
            raise InputError(f"texels is {texels:,}; allowed: 64 to {MAX_TEXELS:,}")
        found = float(np.sqrt(texels / area))
    else:
        faces = 0 if isinstance(surface, MeshSurface) else len(surface.faces)
        fewest = min(MOST_FACES_TEXELS, max(64, smallest * smallest * faces))
        pixels = scale * scale * area
        fine = 4 * pixels if 4 * pixels <= MOST_TEXELS else pixels
        wanted = np.clip(fine, fewest, max(fewest, MOST_TEXELS))
        found = float(np.sqrt(wanted / area))
    total = found * found * area
    _check_total(total)
    _check_ratio(scale, found, total, exemplar_width, sample_size, density)
    return TextureScale(found, scale, width, texels or round(total))


def _check_ratio(
    scale: float,
    found: float,
    total: float,
    exemplar_width: int,
    sample_size: float | None,
    density: float | None,
) -> None:
    """Raise InputError where a texel is far larger or smaller than a pixel of the sample."""
    if found / PER_TEXEL <= scale <= found * PER_TEXEL:
        return
    if sample_size is not None:
        asked = f"sample size is {sample_size:g} model units"
        low, high = (exemplar_width / found * share for share in (1 / PER_TEXEL, PER_TEXEL))
    elif density is not None:
        asked = f"density is {density:g} texels per model unit"
        low, high = scale / PER_TEXEL, scale * PER_TEXEL
    else:
        asked = f"texels is {total:,.0f}"
        low, high = (total * (scale / found) ** 2 * share**2 for share in (1 / PER_TEXEL, PER_TEXEL))
    raise InputError(
        f"{asked}, {scale / found:.3g} pixels of the sample to a texel; allowed: {low:.6g} to {high:.6g} for "
        f"this sample of {exemplar_width} pixels; --resize makes it smaller"
    )


def _positive(name: str, value: float, unit: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} is {value}; allowed: a finite number above 0, in {unit}")
    return float(value)


def default_width(size: float, area: float) -> float:
    """Return the default width of the sample on a surface of this diagonal and area: see `texture_scale`."""
    return min(size / SHARE, float(np.sqrt(area)) / 2)


def area_of(surface: AnySurface) -> float:
    """Return a surface's area in square model units.

    It is computed from 8 × 8 Gauss points on each patch, or from the triangles on a mesh's islands.
    """
    if isinstance(surface, MeshSurface):
        return float(surface.mesh.areas[surface.island >= 0].sum())
    return sum(area for _, area in _row_areas(surface))


def face_areas(surface: Surface) -> FloatArray:
    """Return the areas of a surface's faces, (F,), in square model units."""
    faces, areas = zip(*_row_areas(surface), strict=True)
    return np.bincount(faces, areas).astype(np.float64)


def _row_areas(surface: Surface) -> Iterator[tuple[int, float]]:
    """Yield the area of each row of patches, with the number of its face."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    u, w = (nodes + 1) / 2, weights / 2
    for number, face in enumerate(surface.faces):
        across = (np.arange(face.columns)[:, None] + u).ravel()
        for row in range(face.rows):
            _, by_s, by_t = face.derivatives_grid(row + u, across)
            area = w @ np.linalg.norm(np.cross(by_s, by_t), axis=2) @ np.tile(w, face.columns)
            yield number, float(area)


def _checked_area(area: float, surface: AnySurface) -> float:
    if not area > 1e-18 * surface.size**2:
        raise InputError("surface has no area; allowed: patches that are more than points and lines")
    return area


def _check_total(texels: float) -> None:
    if texels > MAX_TEXELS:
        raise InputError(
            f"density makes {texels:,.0f} texels, which would take {3 * texels / 2**30:.1f} GiB as 8-bit "
            f"RGB; allowed: {MAX_TEXELS:,}"
        )


def _extents(halving: Halving) -> tuple[FloatArray, FloatArray]:
    """Return typical height and width of all charts, and of their root pieces: (charts, 2) each."""
    pieces = halving.pieces
    # Round away numerical noise: sizes are chosen right where they jump by a texel.
    extents = [[float(f"{x:.9g}") for x in halving.extents(piece).tolist()] for piece in pieces]
    return np.array(extents), halving.whole[[piece.root for piece in pieces]]


def _rounded(
    extents: FloatArray, whole: FloatArray, density: float, smallest: int, thinnest: int
) -> NDArray[np.int64]:
    """Return height and width of all charts in texels, (charts, 2)."""
    size = np.maximum(extents * density, np.clip(whole * density, thinnest, smallest))
    # Slightly more than one half, so that values exactly between two sizes round alike on any machine.
    return np.floor(size + 0.5 + 1e-9).astype(np.int64)


def _density(extents: FloatArray, whole: FloatArray, texels: int, smallest: int, thinnest: int) -> float:
    """Return the density at which the charts hold this many texels."""

    def total(density: float) -> int:
        return int(_rounded(extents, whole, density, smallest, thinnest).prod(axis=1).sum())

    low, high = 0.0, 1.5 * float(np.sqrt(texels / extents.prod(axis=1).sum()))
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if total(middle) < texels else (low, middle)
    # Equal charts grow together, so the total just below may be nearer.
    return low if texels - total(low) < total(high) - texels else high
