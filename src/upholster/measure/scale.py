"""How large texels are on the surface: density, scale, anisotropy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.errors import InputError
from upholster.geometry import MeshSurface, Surface
from upholster.measure.meshes import triangle_steps
from upholster.model import face_parameters
from upholster.quilt import Chart
from upholster.types import FloatArray

__all__ = ["TexelScale", "check_faces", "mesh_texel_scale", "quantiles", "texel_scale"]

MOST_SAMPLES = 2**19
MOST_NODES = 128


@dataclass(frozen=True, slots=True)
class TexelScale:
    """How evenly texels lie on a surface; all figures weigh every part of the surface by its area.

    Attributes
    ----------
    spread
        99th over 1st percentile of texel area: 1 where all are equally large.
    error
        Mean absolute deviation of log2 of the texel size, along rows and along columns alike, from its
        median: in octaves, 0 where all have one size. The median stands in for a scale asked for.
    error_95
        95th percentile of the same: 0.0704 is 5 %.
    anisotropy
        Median of a texel's greatest over its least stretch: 1 where texels are square.
    anisotropy_95
        95th percentile of the same.
    """

    spread: float
    error: float
    error_95: float
    anisotropy: float
    anisotropy_95: float


def texel_scale(surface: Surface, charts: Sequence[Chart]) -> TexelScale:
    """Measure how large texels are on the surface.

    With J = [J_r, J_c] the surface's derivatives by texel rows and columns, a texel's area is |J_r × J_c|,
    its sizes are |J_r| and |J_c|, and its stretches are J's singular values. They are evaluated at the
    middles of an even grid of parameters on every chart: half a million points in all, 4² to 128² per chart.
    Points without area (poles) have no weight.

    Parameters
    ----------
    surface
        The surface.
    charts
        What covers it: at least one chart.

    Returns
    -------
    TexelScale
        Ratios and octaves.

    Raises
    ------
    InputError
        If there is no chart, one names a face that the surface does not have, or nothing has any area.

    References
    ----------
    Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3: singular
    values of the parametrisation as local stretch.
    """
    if not charts:
        raise InputError("there are no charts; allowed: at least one")
    nodes = int(np.clip(np.sqrt(MOST_SAMPLES / len(charts)), 4, MOST_NODES))
    middle = (np.arange(nodes) + 0.5) / nodes
    # Per point: squares and product of J_r and J_c, and how many texels it stands for.
    parts = []
    check_faces(surface, charts)
    for chart in charts:
        s, t = face_parameters(chart, middle * chart.height, middle * chart.width)
        _, by_s, by_t = surface.faces[chart.face].derivatives_grid(s, t)
        down = by_s.reshape(-1, 3) * ((chart.s1 - chart.s0) / chart.height)
        right = by_t.reshape(-1, 3) * ((chart.t1 - chart.t0) / chart.width)
        texels = np.full(len(down), chart.height * chart.width / len(down))
        products = [np.einsum("ij,ij->i", a, b) for a, b in ((down, down), (down, right), (right, right))]
        parts.append(np.stack([*products, texels]))
    return _scale_of(np.concatenate(parts, axis=1))


def mesh_texel_scale(surface: MeshSurface, charts: Sequence[Chart]) -> TexelScale:
    """Measure how large texels are on a mesh, as `texel_scale` does, triangle by triangle."""
    down, right = np.moveaxis(triangle_steps(surface, tuple(charts)), 2, 0)
    products = [np.einsum("ij,ij->i", a, b) for a, b in ((down, down), (down, right), (right, right))]
    flat = np.sqrt(np.maximum(products[0] * products[2] - products[1] ** 2, 0))
    texels = np.divide(surface.mesh.areas, flat, out=np.zeros(len(flat)), where=flat > 0)
    return _scale_of(np.stack([*products, texels]))


def _scale_of(parts: FloatArray) -> TexelScale:
    # From squares and product of J_r and J_c, and how many texels each stands for.
    e, f, g, texels = parts
    area = np.sqrt(np.maximum(e * g - f * f, 0))
    # Rounding leaves a pole some tiny area: not a part of the surface.
    real = area > 1e-12 * area.max()
    if not real.any():
        raise InputError("surface has no area; allowed: patches that are more than points and lines")
    e, f, g, texels, area = e[real], f[real], g[real], texels[real], area[real]
    weights = area * texels
    low, high = quantiles(area, weights, (0.01, 0.99))
    sizes, both = 0.5 * np.log2(np.concatenate([e, g])), np.tile(weights, 2)
    deviation = np.abs(sizes - quantiles(sizes, both, (0.5,))[0])
    mean, half = (e + g) / 2, np.hypot((e - g) / 2, f)
    stretch = (mean + half) / area  # greatest² / (greatest · least)
    median, most = quantiles(stretch, weights, (0.5, 0.95))
    return TexelScale(
        spread=high / low,
        error=float(np.average(deviation, weights=both)),
        error_95=quantiles(deviation, both, (0.95,))[0],
        anisotropy=median,
        anisotropy_95=most,
    )


def check_faces(surface: Surface, charts: Sequence[Chart]) -> None:
    """Raise InputError if a chart names a face that the surface does not have, or reaches beyond it."""
    for index, chart in enumerate(charts):
        if not 0 <= chart.face < len(surface.faces):
            raise InputError(
                f"chart {index} lies on face {chart.face}; the surface has 0 to {len(surface.faces) - 1}"
            )
        face = surface.faces[chart.face]
        if chart.s1 > face.rows or chart.t1 > face.columns:
            raise InputError(
                f"chart {index} reaches to s = {chart.s1:g}, t = {chart.t1:g}; "
                f"allowed on face {chart.face}: up to {face.rows}, {face.columns}"
            )


def quantiles(values: FloatArray, weights: FloatArray, wanted: Sequence[float]) -> list[float]:
    """Return the values below which the wanted shares of the weight lie."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order])
    places = np.searchsorted(below, np.asarray(wanted) * below[-1])
    found: list[float] = values[order[np.minimum(places, len(values) - 1)]].tolist()
    return found
