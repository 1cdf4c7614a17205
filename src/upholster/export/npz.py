"""The texels of every chart as NumPy arrays."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from upholster.synthesis.quilt import Texels

__all__ = ["write_npz"]


def write_npz(path: str | os.PathLike[str], texels: Texels) -> None:
    """Write texels as an ``.npz`` file, for `numpy.load`.

    It holds ``chart_000``, ``chart_001`` … ((height, width, C), of the exemplar's dtype), and of the layout
    ``patch`` ((N,) int32, the patch that each chart covers), ``size`` ((N, 2) int32, height and width in
    texels) and ``rectangle`` ((N, 4) float64, the parameters s0, s1, t0, t1 that it covers).

    Parameters
    ----------
    path
        The file to write.
    texels
        What painting gave.
    """
    charts = texels.charts
    digits = max(3, len(str(len(charts) - 1)))
    content: dict[str, Any] = {
        "patch": np.array([chart.patch for chart in charts], np.int32),
        "size": np.array([(chart.height, chart.width) for chart in charts], np.int32).reshape(-1, 2),
        "rectangle": np.array([(c.s0, c.s1, c.t0, c.t1) for c in charts], np.float64).reshape(-1, 4),
    }
    content |= {f"chart_{index:0{digits}d}": array for index, array in enumerate(texels.arrays)}
    # An open file, for given a name NumPy would add a suffix to one that has none.
    with Path(path).open("wb") as file:
        np.savez(file, **content)
