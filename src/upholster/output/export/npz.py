"""The texels of every chart as NumPy arrays."""

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from upholster.base.files import writing
from upholster.quilt.model import Texels

__all__ = ["write_npz"]


def write_npz(
    path: str | os.PathLike[str], texels: Texels, *, maps: Mapping[str, Texels] | None = None
) -> None:
    """Write texels as an ``.npz`` file, for `numpy.load`.

    It holds ``chart_000``, ``chart_001`` … ((height, width, C), of the exemplar's dtype), and for the layout
    ``face`` ((N,) int32, the face of each chart), ``size`` ((N, 2) int32, height and width in texels) and
    ``rectangle`` ((N, 4) float64, the parameters s0, s1, t0, t1 that it covers). For a material the charts
    are the base colour; its other maps are ``normal_000``, ``roughness_000`` … by role.

    Parameters
    ----------
    path
        The file to write.
    texels
        The painted texels.
    maps
        A material's other maps, by role, on the same charts.
    """
    charts = texels.charts
    digits = max(3, len(str(len(charts) - 1)))
    content: dict[str, Any] = {
        "face": np.array([chart.face for chart in charts], np.int32),
        "size": np.array([(chart.height, chart.width) for chart in charts], np.int32).reshape(-1, 2),
        "rectangle": np.array([(c.s0, c.s1, c.t0, c.t1) for c in charts], np.float64).reshape(-1, 4),
    }
    for name, painted in {"chart": texels, **(maps or {})}.items():
        content |= {f"{name}_{index:0{digits}d}": array for index, array in enumerate(painted.arrays)}
    # An open file, because NumPy would add a suffix to a name without one.
    with writing(path) as file:
        np.savez(file, **content)
