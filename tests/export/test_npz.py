from pathlib import Path
from typing import Any

import numpy as np
import pytest
from textured import make_model

from upholster.output.export.npz import write_npz
from upholster.quilt.chart import Chart
from upholster.quilt.model import Texels


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_texels_come_back(tmp_path: Path, dtype: Any) -> None:
    texels = make_model(channels=4, dtype=dtype).texels
    write_npz(tmp_path / "x.npz", texels)
    with np.load(tmp_path / "x.npz", allow_pickle=False) as file:
        assert sorted(file) == sorted(["face", "size", "rectangle", *(f"chart_{k:03d}" for k in range(16))])
        for k, (chart, array) in enumerate(zip(texels.charts, texels.arrays, strict=True)):
            found = file[f"chart_{k:03d}"]
            assert found.dtype == array.dtype
            np.testing.assert_array_equal(found, array)
            assert file["face"][k] == chart.face
            assert tuple(file["size"][k]) == (chart.height, chart.width) == found.shape[:2]
            assert tuple(file["rectangle"][k]) == (chart.s0, chart.s1, chart.t0, chart.t1)


def test_many_charts_sort_by_name(tmp_path: Path) -> None:
    texels = Texels(
        tuple(Chart(k, 1, 2, 0.25, 0.5, 0, 1) for k in range(1001)),
        tuple(np.full((1, 2, 1), k, np.uint16) for k in range(1001)),
    )
    write_npz(tmp_path / "temporary", texels)
    with np.load(tmp_path / "temporary") as file:
        names = sorted(name for name in file if name.startswith("chart_"))
        assert [int(file[name][0, 0, 0]) for name in names] == list(range(1001))
        assert tuple(file["rectangle"][7]) == (0.25, 0.5, 0, 1)
