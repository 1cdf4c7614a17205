"""The size of texels on the surface: density, scale, anisotropy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.charts.charted_surface import charted_surface
from upholster.covering.measure.measure_rows import Row, figure
from upholster.geometry.any_surface import AnySurface
from upholster.quilt.chart import Chart

__all__ = ["FINER", "TexelScale", "quantiles", "texel_scale"]

FINER = 3
"""Triangles of patches are this many times finer each way than in synthesis, where a texel's steps vary by up
to a half over one triangle."""


@dataclass(frozen=True, slots=True)
class TexelScale:
    """How even texels are on a surface; all figures weight every part of the surface by its area.

    Attributes
    ----------
    spread
        99th over 1st percentile of texel area: 1 if all are equally large.
    error
        Mean absolute deviation of log2 of the texel size, along rows and along columns alike, from its
        median: in octaves, 0 if all have one size. The median stands in for a requested scale.
    error_95
        95th percentile of the same: 0.0704 is 5 %.
    anisotropy
        Median of a texel's greatest over its least stretch: 1 if texels are square.
    anisotropy_95
        95th percentile of the same.
    """

    spread: float
    error: float
    error_95: float
    anisotropy: float
    anisotropy_95: float

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        return [
            ("texel area, 99 % over 1 %", figure(self.spread), "1: even"),
            ("texel size error, mean", f"{self.error:.3f} octaves", "0: even"),
            ("texel size error, 95 %", f"{self.error_95:.3f} octaves", "0.07: within 5 %"),
            ("texel anisotropy, median", figure(self.anisotropy), "1: square texels"),
            ("texel anisotropy, 95 %", figure(self.anisotropy_95), "1: square texels"),
        ]


def texel_scale(surface: AnySurface, charts: Sequence[Chart]) -> TexelScale:
    """Measure how large texels are on the surface.

    With J = [J_r, J_c] the surface's derivatives by texel rows and columns, a texel's area is
    ``|J_r × J_c|``, its sizes are ``|J_r|`` and ``|J_c|``, and its stretches are J's singular values: those
    of the charted surface's triangles.

    Parameters
    ----------
    surface
        The surface.
    charts
        The charts that cover it: at least one.

    Returns
    -------
    TexelScale
        Ratios and octaves.

    Raises
    ------
    InputError
        If there is no chart, one names a face that the surface does not have, or there is no area.

    References
    ----------
    Sander, Snyder, Gortler, Hoppe: Texture mapping progressive meshes, SIGGRAPH 2001, section 3: singular
    values of the parametrisation as local stretch.
    """
    if not charts:
        raise InputError("there are no charts; allowed: at least one")
    charted = charted_surface(surface, charts, finer=FINER)
    down, right = np.moveaxis(charted.steps, 2, 0)
    e, f, g = (np.einsum("ij,ij->i", a, b) for a, b in ((down, down), (down, right), (right, right)))
    area = np.sqrt(np.maximum(e * g - f * f, 0))
    real = area > 0
    if not real.any():
        raise InputError("surface has no area; allowed: triangles that are more than points and lines")
    e, f, g, area, weights = e[real], f[real], g[real], area[real], charted.mesh.areas[real]
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


def quantiles(values: FloatArray, weights: FloatArray, wanted: Sequence[float]) -> list[float]:
    """Return the values below which the wanted shares of the weight lie."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order])
    places = np.searchsorted(below, np.asarray(wanted) * below[-1])
    found: list[float] = values[order[np.minimum(places, len(values) - 1)]].tolist()
    return found
